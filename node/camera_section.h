#pragma once

#include <string>

#include "lib/config/toml_file.h"
#include "node/capture/camera_settings.h"

namespace imprint {

/// `[camera]` of node.toml; faults are noted at their keys.
CameraSettings read_camera_section(TomlReader& read);
/// The same in the file's own form.
std::string camera_to_toml(const CameraSettings& settings);

}  // namespace imprint
