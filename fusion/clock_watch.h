#pragma once

#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "fusion/serve/line_board.h"
#include "lib/result/result.h"
#include "lib/transport/transport.h"
#include "lib/wire/keys.h"

namespace imprint {

/// The difference of a node's clock from this machine's, from the times at which a question left here, arrived there,
/// and its answer left there and arrived here, in ns. True within `uncertainty_ns` however the way is divided.
ClockOffset clock_offset(std::int64_t asked_ns, std::int64_t received_ns, std::int64_t sent_ns,
                         std::int64_t answered_ns);

/// Measures the clock of every connected node every few seconds, the best of some round trips, and shows it on the
/// board; a difference above `limit_s` raises an alarm `clock_<camera>`, which ends below half of that. Blocks only its
/// own thread.
class ClockWatch {
 public:
  ClockWatch(Transport& transport, Keys keys, LineBoard& board, double limit_s);
  ~ClockWatch();
  ClockWatch(const ClockWatch&) = delete;
  ClockWatch& operator=(const ClockWatch&) = delete;

  /// A camera that has come is asked at once.
  void set_alive(const std::string& camera_id, bool alive);
  /// The last measurement; none before the first.
  [[nodiscard]] std::optional<ClockOffset> offset(const std::string& camera_id) const;

 private:
  void work();
  void measure(const std::string& camera_id);

  Transport& transport_;
  const Keys keys_;
  LineBoard& board_;
  const double limit_s_;

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  bool stopping_ = false;
  bool came_ = false;
  std::set<std::string> alive_;
  std::map<std::string, ClockOffset> offsets_;
  std::set<std::string> alarmed_;

  std::thread worker_;
};

}  // namespace imprint
