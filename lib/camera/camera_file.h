#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "lib/camera/camera_model.h"
#include "lib/result/result.h"

namespace imprint {

inline constexpr int kLargestSide_px = 32767;  ///< what 16-bit image coordinates hold; also keeps memory bounded

/// Whether `id` may be a camera's: letters, digits, _ and -, as it becomes part of a key.
bool is_camera_name(std::string_view id);

/// Reads `camN.toml` of the contract, or (*.yaml, *.yml) a calibration of OpenCV or ROS, see camera_yaml.h; keys it
/// does not know are ignored. `warnings`: how far a camera of another model is from ours.
Result<CameraModel> read_camera_file(const std::filesystem::path& path, std::vector<std::string>* warnings = nullptr);

/// `record`: TOML put below, such as where the constants come from; readers of the camera ignore it.
Result<void> write_camera_file(const CameraModel& camera, const std::filesystem::path& path,
                               const std::string& record = {});

}  // namespace imprint
