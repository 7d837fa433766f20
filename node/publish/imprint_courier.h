#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "lib/daemon/bounded_queue.h"
#include "lib/imprint/imprint.h"
#include "lib/result/result.h"
#include "lib/transport/transport.h"
#include "lib/wire/keys.h"
#include "lib/wire/wire.h"
#include "node/publish/imprint_spool.h"
#include "node/publish/retry_schedule.h"

namespace imprint {

/// A number that no other start of a node has: what tells a restarted node's imprints from those before.
std::uint64_t make_boot_id();

/// Brings one camera's imprints to fusion, whatever happens on the way: each is on the node's disk before it is sent,
/// and stays there until fusion's receipt says that it is on fusion's. Without a receipt it is sent again: at once when
/// fusion has come (back), else after a timeout, as long as fusion is there, a few at a time and below what is
/// measured now. Fusion drops what it already has.
class ImprintCourier {
 public:
  /// Takes up what the spool holds from earlier starts.
  static Result<std::unique_ptr<ImprintCourier>> start(Transport& transport, const Keys& keys,
                                                       const std::string& camera_id, std::uint64_t boot_id,
                                                       ImprintSpool spool, RetryConfig retry);
  ~ImprintCourier();
  ImprintCourier(const ImprintCourier&) = delete;
  ImprintCourier& operator=(const ImprintCourier&) = delete;

  /// Stamps boot and sequence, keeps and sends. Does not fail: what cannot be sent now is sent later.
  void send(Imprint imprint);
  /// Session and observation of the good imprints that earlier starts have left: answered, whatever fusion thinks.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint32_t>> answered_before() const;
  /// Tells fusion what waits here.
  void report();
  /// Of the last imprint sent.
  [[nodiscard]] std::uint64_t sequence() const;

 private:
  struct Event {
    enum class Kind { receipt, fusion_came, fusion_left, imprint_sent } kind;
    Bytes bytes;
  };

  ImprintCourier(const Keys& keys, std::string camera_id, std::uint64_t boot_id, ImprintSpool spool, RetryConfig retry);
  Result<void> declare(Transport& transport);
  void work();
  void handle(const Event& event);
  void receive(const Receipt& receipt);
  void send_again();
  void note_earlier_starts();
  [[nodiscard]] Delivery state() const;  // with `mutex_` held

  const Keys keys_;
  const std::string camera_id_;
  const std::uint64_t boot_id_;
  std::unique_ptr<Publisher> live_;
  std::unique_ptr<Publisher> backlog_;
  std::unique_ptr<Publisher> reports_;
  std::shared_ptr<BoundedQueue<Event>> events_;
  std::vector<std::unique_ptr<Declaration>> declarations_;

  mutable std::mutex mutex_;  // guards what follows
  ImprintSpool spool_;
  RetrySchedule schedule_;
  std::uint64_t sequence_ = 0;
  std::uint64_t refused_ = 0;
  std::vector<std::pair<std::string, std::uint32_t>> answered_before_;

  bool fusion_is_there_ = false;  // the worker's own
  std::thread worker_;
};

}  // namespace imprint
