#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "lib/result/result.h"
#include "node/capture/frame_source.h"

namespace imprint {

inline constexpr double kSceneExposureUs = 1000.0;

/// A simulated camera: renders the triggered observation of a scene file, as `imprint simulate` would have.
/// Its exposure can be set: at kSceneExposureUs and 0 dB the scene has the levels that its file says.
/// Fails (invalid_input) when the scene cannot be read.
Result<std::unique_ptr<FrameSource>> open_simulation_source(const std::filesystem::path& scene,
                                                            const std::string& camera_id);

}  // namespace imprint
