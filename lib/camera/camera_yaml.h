#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lib/camera/camera_model.h"
#include "lib/result/result.h"

namespace imprint {

/// The camera as `cv::FileStorage` reads it (image_width, camera_matrix, distortion_coefficients), and as the
/// camera_info files of ROS are written. A comment on top says how far the two models are apart.
std::string camera_as_opencv_yaml(const CameraModel& camera);
std::string camera_as_ros_yaml(const CameraModel& camera);

/// Reads either. A camera without a name gets that of the file; without `pixel_pitch_um` (neither format has it, ours
/// are written with it) the pitch is 0: unknown. Where the models differ by more than 0.001 px, `warnings` says by how
/// much. Fails (invalid_input) on a missing key, a model of distortion that we do not have, or a folded image.
Result<CameraModel> read_camera_yaml(const std::filesystem::path& path, std::vector<std::string>* warnings = nullptr);

/// Whether the file's name says YAML.
bool is_yaml_name(const std::filesystem::path& path);

}  // namespace imprint
