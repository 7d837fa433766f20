#pragma once

#include <filesystem>

#include "lib/camera/camera_model.h"
#include "lib/result/result.h"

namespace imprint {

/// Reads `camN.toml` of the contract; keys it does not know are ignored.
Result<CameraModel> read_camera_file(const std::filesystem::path& path);

/// `record`: TOML put below, such as where the constants come from; readers of the camera ignore it.
Result<void> write_camera_file(const CameraModel& camera, const std::filesystem::path& path,
                               const std::string& record = {});

}  // namespace imprint
