#pragma once

#include <filesystem>
#include <map>

#include <Eigen/Core>

#include "lib/camera/camera_model.h"
#include "lib/camera/camera_pose.h"
#include "lib/result/result.h"

namespace imprint {

/// A coded target's dot in space.
struct DotDisc {
  double radius = 0.0;                                ///< in mm, or in the unit of the network it was found in
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< length 1, towards the cameras; in the world
  int sights = 0;                                     ///< that told; 0 where they are read from a file
};

/// By target id.
using DotDiscs = std::map<int, DotDisc>;

/// How far the centre of the disc's image lies from the image of its centre, in observed px: perspective makes the
/// nearer half larger, and the lens bends across the dot. The disc must lie before the camera.
ObservedPoint eccentricity_px(const CameraModel& camera, const CameraPose& pose, const Eigen::Vector3d& p_world,
                              const DotDisc& disc);

/// Reads `dots.csv`: header `id,diameter_mm,nx,ny,nz`, one target a row. Names the line of a repeated id, of a value
/// that is no finite number, of a diameter that is not positive and of a normal that is not of length 1 (to 1 %).
Result<DotDiscs> read_dot_discs(const std::filesystem::path& path);

Result<void> write_dot_discs(const DotDiscs& dots, const std::filesystem::path& path);

}  // namespace imprint
