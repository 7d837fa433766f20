#pragma once

#include <vector>

#include "simulation/layout.h"

namespace imprint {

/// Plates all over the measurement volume, so placed that every camera of the scene sees about
/// `targets.per_camera`, spread over its image, none behind another plate or in line with the forging.
/// `layout` gives body, library and poses. Fails (invalid_input) when too few find room or codes run out.
Result<std::vector<Plate>> place_plates(const Scene& scene, const Layout& layout);

/// A plate seen at less than this angle from its normal is one a camera can be expected to read.
inline constexpr double readable_facing = 0.5;  // cos 60 deg

/// Whether all of the plate lies in the camera's image and faces it well enough to be read.
bool plate_readable(const Plate& plate, double plate_mm, const CameraModel& camera, const CameraPose& pose);

}  // namespace imprint
