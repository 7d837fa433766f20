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
#include "node/service/rest_watch.h"
#include "node/service/thermometer.h"

namespace imprint {

/// `process_frame` of the pipeline with this node's camera, rig and method.
using ProcessFrame = std::function<ProcessedFrame(const Frame&)>;
/// Where the forging is in a frame, roughly and quickly; nothing when none is seen.
using SeeForging = std::function<std::optional<Segmentation>(const Frame&)>;

/// The running camera node: a trigger comes in, a frame is taken and worked on, its imprint goes out; a failed one
/// too, so that fusion need not wait. One worker thread does it; the transport's callback only queues. The imprint
/// stays on disk until fusion has it on its own.
///
/// Triggers are taken live, without history: a node that starts late does not fire at what has long been moved away.
/// Fusion sends a trigger again to a camera that connects while it is still waited for. A trigger that this node has
/// answered well, now or before a restart as long as the imprint waits on its disk, is not answered again; one that
/// failed is.
///
/// With `rest.trigger` the worker also looks for the forging while no trigger waits, and asks fusion for an observation
/// when it has come to rest: this node fires with all others, when fusion's trigger says so.
class NodeService {
 public:
  NodeService(NodeConfig config, FrameSource& source, ProcessFrame process, Transport& transport, SeeForging see = {});
  NodeService(const NodeService&) = delete;
  NodeService& operator=(const NodeService&) = delete;
  ~NodeService() { stop(); }

  Result<void> start();
  /// Ends after the frame that is being worked on.
  void stop();
  /// Sends the health record and what waits for fusion; due every `health_period_s`, and done by itself after every
  /// frame.
  void send_health();
  /// In one line whether it does its work: begins with "good: " when its camera gives frames and the last frame, if
  /// there was one, showed targets; else says what is missing.
  [[nodiscard]] std::string condition();
  /// Whether one frame has been worked on for longer than `limit`: the worker hangs.
  [[nodiscard]] bool stuck(std::chrono::seconds limit) const;

 private:
  void work();
  /// One look at the scene, as a trigger would now find it; asks for an observation when the forging came to rest.
  void look();
  void receive(const Bytes& message);
  /// Waits for the trigger's moment, which is by fusion's clock; false when the node is stopped meanwhile.
  bool await(const Trigger& trigger, std::vector<std::string>& warnings);
  /// When the frame is to have been taken, by this machine's clock; 0: now.
  [[nodiscard]] std::int64_t moment_of(const Trigger& trigger) const;
  Imprint make_imprint(const Trigger& trigger);
  /// Sets the exposure of the next frame by what this one showed, and says where that is not possible.
  void control_exposure(const Frame& frame, Imprint& imprint);
  void note(const Imprint& imprint);
  void read_board();  // and how its camera does, into the health record; with its lock held

  NodeConfig config_;
  FrameSource& source_;
  ProcessFrame process_;
  SeeForging see_;
  Transport& transport_;
  std::shared_ptr<BoundedQueue<Bytes>> triggers_;
  std::deque<std::pair<std::string, std::uint32_t>> answered_;  // session, observation; the oldest first
  RestWatch rest_;
  std::unique_ptr<Publisher> rest_publisher_;  // nothing: not to be watched for
  CaptureRequest next_request_;                // what the next trigger will probably want

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
