#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "lib/result/result.h"
#include "node/capture/frame.h"

namespace imprint {

/// Which picture is wanted: what the trigger said.
struct CaptureRequest {
  std::string session;
  int observation = 0;
  double rotation_deg = 0.0;
};

/// Where a node's frames come from. Everything that is hardware, a file or a simulation is behind this interface.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// One frame, taken now. Fails (job_failed or invalid_input) naming the device or the file; may be called again.
  virtual Result<Frame> capture(const CaptureRequest& request) = 0;
  /// Nothing when its exposure cannot be set, as that of pictures already taken.
  [[nodiscard]] virtual AdjustableExposure* adjustable_exposure() { return nullptr; }
};

inline constexpr auto kFrameSources = std::to_array<std::string_view>({"folder", "session", "simulation"});

/// Opens one of `kFrameSources`; `path` is the folder of pictures, the session.toml or the scene file.
Result<std::unique_ptr<FrameSource>> open_frame_source(std::string_view source, const std::filesystem::path& path,
                                                       const std::string& camera_id);

}  // namespace imprint
