#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "fusion/fusion_config.h"
#include "fusion/fusion_pipeline.h"
#include "fusion/receive/observation_assembler.h"
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
/// before it is announced. One worker thread does all of it in order; callbacks only queue.
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
  /// Stores what has been received so far, then ends.
  void stop();
  /// Grows with every turn of the worker's loop and with every message, write that is tried again and session in it;
  /// at least once a second as long as the worker does not hang. A fusion counts once, when it is done.
  [[nodiscard]] std::uint64_t turns() const { return turns_; }

 private:
  enum class Kind { trigger, imprint, health, alive, gone };
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
  void receive_liveness(const std::string& camera_id, bool alive);
  /// Puts a stored session back into the assembler, each message as old as it is.
  void recall(const std::string& session);
  void evaluate();
  void make_result(const std::string& session);
  void announce(const StoredResult& result);
  void write_result_file(const StoredResult& result);
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
  std::shared_ptr<BoundedQueue<Message>> queue_;
  std::shared_ptr<BoundedQueue<std::shared_ptr<Query>>> queries_;
  std::map<std::string, std::unique_ptr<Publisher>> result_publishers_;
  std::deque<std::string> published_sessions_;  // the oldest first
  std::unique_ptr<Publisher> trigger_publisher_;
  std::vector<std::unique_ptr<Declaration>> declarations_;
  std::atomic<bool> stopping_ = false;
  std::atomic<std::uint64_t> turns_ = 0;
  std::thread worker_;
  std::thread answerer_;
};

}  // namespace imprint
