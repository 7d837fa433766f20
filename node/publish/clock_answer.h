#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "lib/daemon/bounded_queue.h"
#include "lib/result/result.h"
#include "lib/transport/transport.h"
#include "lib/wire/keys.h"

namespace imprint {

/// Tells fusion this node's time when it asks (`cam/<id>/service/clock`), and keeps what fusion says of the difference.
/// A thread of its own answers, so that a frame that is being worked on does not distort the measurement.
class ClockAnswer {
 public:
  static Result<std::unique_ptr<ClockAnswer>> start(Transport& transport, const Keys& keys,
                                                    const std::string& camera_id);
  ~ClockAnswer();
  ClockAnswer(const ClockAnswer&) = delete;
  ClockAnswer& operator=(const ClockAnswer&) = delete;

  /// This node's clock minus fusion's, as fusion has last measured it; 0 until it has.
  [[nodiscard]] std::int64_t offset_ns() const { return *offset_ns_; }

 private:
  struct Question {
    std::shared_ptr<Query> query;
    std::int64_t received_ns = 0;
  };

  ClockAnswer();
  void work();

  std::shared_ptr<BoundedQueue<Question>> questions_;
  std::shared_ptr<std::atomic<std::int64_t>> offset_ns_;
  std::unique_ptr<Declaration> declaration_;
  std::thread worker_;
};

}  // namespace imprint
