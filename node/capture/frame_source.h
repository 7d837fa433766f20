#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "lib/result/result.h"
#include "node/capture/camera_settings.h"
#include "node/capture/capture_status.h"
#include "node/capture/frame.h"

namespace imprint {

/// Which picture is wanted: what the trigger said.
struct CaptureRequest {
  std::string session;
  int observation = 0;
  double rotation_deg = 0.0;
  std::int64_t moment_ns = 0;  ///< when it is to have been taken, by this machine's wall clock; 0: now
};

/// Where a node's frames come from. Everything that is hardware, a file or a simulation is behind this interface.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// One frame, taken now. Fails (job_failed or invalid_input) naming the device or the file; may be called again.
  virtual Result<Frame> capture(const CaptureRequest& request) = 0;
  /// Nothing of a source that has no camera to lose.
  [[nodiscard]] virtual std::optional<CaptureStatus> status() const { return std::nullopt; }
  /// Nothing when its exposure cannot be set, as that of pictures already taken.
  [[nodiscard]] virtual AdjustableExposure* adjustable_exposure() { return nullptr; }
};

/// Cameras, as far as this program was built with them: v4l2 always, aravis with its library.
std::span<const std::string_view> camera_sources();
/// Pictures that are there already, or are rendered.
inline constexpr auto kFrameSources = std::to_array<std::string_view>({"folder", "session", "simulation"});

/// Opens one of `kFrameSources`; `path` is the folder of pictures, the session.toml or the scene file.
Result<std::unique_ptr<FrameSource>> open_frame_source(std::string_view source, const std::filesystem::path& path,
                                                       const std::string& camera_id);

/// Opens one of `camera_sources`. A camera that is not there now is no failure: it is tried again, and `status` says
/// so. Fails (invalid_input) on settings that cannot be.
Result<std::unique_ptr<FrameSource>> open_camera_source(std::string_view source, const CameraSettings& settings,
                                                        const std::string& camera_id);

}  // namespace imprint
