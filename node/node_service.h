#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "lib/daemon/bounded_queue.h"
#include "lib/transport/transport.h"
#include "lib/wire/wire.h"
#include "node/capture/frame_source.h"
#include "node/node_config.h"
#include "node/node_pipeline.h"
#include "node/publish/clock_answer.h"
#include "node/publish/imprint_courier.h"
#include "node/service/thermometer.h"

namespace imprint {

/// `process_frame` of the pipeline with this node's camera, rig and method.
using ProcessFrame = std::function<ProcessedFrame(const Frame&)>;

/// The running camera node: a trigger comes in, a frame is taken and worked on, its imprint goes out; a failed one
/// too, so that fusion need not wait. One worker thread does it; the transport's callback only queues. The imprint
/// stays on disk until fusion has it on its own.
///
/// Triggers are taken live, without history: a node that starts late does not fire at what has long been moved away.
/// Fusion sends a trigger again to a camera that connects while it is still waited for. A trigger that this node has
/// answered well, now or before a restart as long as the imprint waits on its disk, is not answered again; one that
/// failed is.
class NodeService {
 public:
  NodeService(NodeConfig config, FrameSource& source, ProcessFrame process, Transport& transport);
  NodeService(const NodeService&) = delete;
  NodeService& operator=(const NodeService&) = delete;
  ~NodeService() { stop(); }

  Result<void> start();
  /// Ends after the frame that is being worked on.
  void stop();
  /// Sends the health record and what waits for fusion; due every `health_period_s`, and done by itself after every
  /// frame.
  void send_health();
  /// Whether one frame has been worked on for longer than `limit`: the worker hangs.
  [[nodiscard]] bool stuck(std::chrono::seconds limit) const;

 private:
  void work();
  void receive(const Bytes& message);
  /// Waits for the trigger's moment, which is by fusion's clock; false when the node is stopped meanwhile.
  bool await(const Trigger& trigger, std::vector<std::string>& warnings);
  Imprint make_imprint(const Trigger& trigger);
  /// Sets the exposure of the next frame by what this one showed, and says where that is not possible.
  void control_exposure(const Frame& frame, Imprint& imprint);
  void note(const Imprint& imprint);
  void read_board();  // into the health record; with its lock held

  NodeConfig config_;
  FrameSource& source_;
  ProcessFrame process_;
  Transport& transport_;
  std::shared_ptr<BoundedQueue<Bytes>> triggers_;
  std::deque<std::pair<std::string, std::uint32_t>> answered_;  // session, observation; the oldest first

  std::unique_ptr<ImprintCourier> courier_;
  std::unique_ptr<ClockAnswer> clock_;
  std::mutex health_mutex_;  // guards the health record and its publisher
  std::unique_ptr<Publisher> health_publisher_;
  Health health_;
  Thermometer housing_;
  Thermometer sensor_;

  std::vector<std::unique_ptr<Declaration>> declarations_;
  std::mutex stop_mutex_;
  std::condition_variable stop_changed_;
  bool stopping_ = false;
  std::atomic<std::int64_t> busy_since_ns_ = 0;  // steady clock; 0: idle
  std::thread worker_;
};

}  // namespace imprint
