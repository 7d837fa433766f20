#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "fusion/clock_watch.h"
#include "fusion/delivery_desk.h"
#include "fusion/fusion_config.h"
#include "fusion/fusion_pipeline.h"
#include "fusion/receive/observation_assembler.h"
#include "fusion/rest_trigger.h"
#include "fusion/result_announcer.h"
#include "fusion/serve/line_board.h"
#include "fusion/store/session_store.h"
#include "lib/daemon/bounded_queue.h"
#include "lib/transport/transport.h"
#include "lib/wire/keys.h"

namespace imprint {

/// `fuse` of the pipeline.
using Fuse = std::function<Result<Measurement>(const std::vector<Observation>&, const ForgingSpec&, std::string session,
                                               std::string method)>;

/// The running fusion node: imprints and triggers come in, are stored, assembled and fused; each result is stored
/// before it is announced. One worker thread does all of it in order; callbacks only queue. A node hears of every
/// imprint that is on disk, and sends those again of which it does not.
///
/// Fusion is the memory of the line's triggers: nodes keep none. A camera that connects while an observation still
/// waits for it is sent the trigger again.
class FusionService {
 public:
  FusionService(FusionConfig config, Rig rig, Transport& transport, SessionStore& store, LineBoard& board, Fuse fuse);
  FusionService(const FusionService&) = delete;
  FusionService& operator=(const FusionService&) = delete;
  ~FusionService() { stop(); }

  /// Takes up the unfinished sessions of the store and begins to receive.
  Result<void> start();
  /// Makes all cameras take an observation, as `imprint trigger` does; it comes back to this node as from anybody else.
  Result<void> fire(const Trigger& trigger) { return trigger_publisher_->put(encode_trigger(trigger)); }
  /// Stores what has been received so far, then ends.
  void stop();
  /// Grows with every turn of the worker's loop and with every message, write that is tried again and session in it;
  /// at least once a second as long as the worker does not hang. A fusion counts once, when it is done.
  [[nodiscard]] std::uint64_t turns() const { return turns_; }

 private:
  enum class Kind { trigger, imprint, health, delivery, rest, alive, gone, wake };
  struct Message {
    Kind kind;
    std::string key;
    Bytes bytes;
  };
  using Time = ObservationAssembler::Time;

  Result<void> subscribe();
  SampleCallback queueing(Kind kind);
  void work();
  void handle(const Message& message);
  void receive_trigger(const Message& message);
  void receive_imprint(const Message& message);
  void receive_health(const Message& message);
  void receive_delivery(const Message& message);
  void receive_rest(const Message& message);
  void receive_liveness(const std::string& camera_id, bool alive);
  /// Puts a stored session back into the assembler, each message as old as it is.
  void recall(const std::string& session);
  void evaluate();
  void make_result(const std::string& session);
  /// Brings back, one a turn, the sessions whose result was due when this program last ended or when they had to leave.
  void take_up_backlog();
  [[nodiscard]] StoredResult evaluated(const std::string& session);
  void show_session(const std::string& session);
  void malformed(const Message& message, const std::string& why);
  void answer_queries();

  /// Repeats a write until it is done: while the disk is full nothing is evaluated that is not stored. False on stop.
  template <class T>
  bool surely(const std::function<Result<T>()>& write, T& outcome);

  FusionConfig config_;
  Rig rig_;
  Transport& transport_;
  SessionStore& store_;
  LineBoard& board_;
  Fuse fuse_;
  ObservationAssembler assembler_;
  std::shared_ptr<Keys> keys_;
  std::optional<DeliveryDesk> desk_;
  std::optional<ResultAnnouncer> announcer_;
  std::optional<ClockWatch> clocks_;
  RestTrigger rest_;
  std::deque<std::string> backlog_;  // sessions whose result may be due, but whose imprints are only in the store
  std::shared_ptr<BoundedQueue<Message>> queue_;
  std::shared_ptr<BoundedQueue<Message>> liveness_;  // of their own, so that a flood of messages cannot hide them
  std::shared_ptr<BoundedQueue<std::shared_ptr<Query>>> queries_;
  std::unique_ptr<Publisher> trigger_publisher_;
  std::vector<std::unique_ptr<Declaration>> declarations_;
  std::atomic<bool> stopping_ = false;
  std::atomic<std::uint64_t> turns_ = 0;
  std::thread worker_;
  std::thread answerer_;
};

}  // namespace imprint
