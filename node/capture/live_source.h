#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "lib/result/result.h"
#include "node/capture/camera_settings.h"
#include "node/capture/camera_stream.h"
#include "node/capture/capture_status.h"
#include "node/capture/frame_ring.h"
#include "node/capture/frame_source.h"

namespace imprint {

struct LiveConfig {
  CameraTrigger trigger = CameraTrigger::free_running;
  std::size_t recent_frames = 2;                 // kept for triggers in the near past
  std::chrono::milliseconds frame_wait{2000};    // a trigger's frame comes within it, or fails; ours
  std::chrono::milliseconds stall{3000};         // a running camera without a frame is opened anew
  std::chrono::milliseconds first_pause{200};    // before a lost camera is tried again; ours
  std::chrono::milliseconds last_pause{10'000};  // the pause doubles up to this; ours
  Exposure exposure{};                           // to start with; time 0: as the camera is set
};

/// A camera that takes pictures on its own time, whatever drives it. One thread of its own opens it, takes its frames
/// and, when it is lost, opens it anew after a pause that grows; a trigger is served from the newest frames. Never
/// waits for the camera but in `capture`, there for at most `frame_wait`.
class LiveSource final : public FrameSource, public AdjustableExposure {
 public:
  /// `name` is the camera's in messages.
  LiveSource(std::string name, OpenStream open, const LiveConfig& config);
  LiveSource(const LiveSource&) = delete;
  LiveSource& operator=(const LiveSource&) = delete;
  ~LiveSource() override;

  /// The frame nearest to the request's moment; without one, or where that frame is gone (a warning says so), the first
  /// from now on.
  Result<Frame> capture(const CaptureRequest& request) override;
  [[nodiscard]] std::optional<CaptureStatus> status() const override;

  AdjustableExposure* adjustable_exposure() override { return this; }
  [[nodiscard]] Exposure exposure() const override;
  Result<void> set_exposure(const Exposure& exposure) override;

 private:
  void run();
  /// Takes frames until the camera is lost or the source ends; gives why.
  std::string take_frames(CameraStream& stream);
  void take(RawFrame frame);
  void lose(const std::string& why);
  bool rest(std::chrono::milliseconds pause);  // false: the source ends
  Result<RawFrame> wait_for_frame(std::int64_t moment_ns, bool from_then_on);

  const std::string name_;
  const OpenStream open_;
  const LiveConfig config_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  FrameRing recent_;
  std::shared_ptr<CameraStream> stream_;  // none while the camera is lost
  CaptureStatus status_;
  Exposure wanted_;           // kept over a loss
  int unsettled_frames_ = 0;  // whose exposure is not known, for it was set while they were on their way
  bool ending_ = false;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace imprint
