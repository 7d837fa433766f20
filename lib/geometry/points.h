#pragma once

#include <Eigen/Core>

namespace imprint {

/// A point of the image as the camera shows it (with lens distortion), in px.
/// Pixel (0, 0) is the centre of the top-left pixel; x right, y down.
struct ObservedPoint {
  double x_px = 0.0;
  double y_px = 0.0;
};

/// A point of the ideal (distortion-free) image, in px from the principal point: x = f X/Z, y = f Y/Z.
struct IdealPoint {
  double x_px = 0.0;
  double y_px = 0.0;
};

/// A ray in the world frame: origin_world_mm + k direction_world, k > 0; the direction has length 1.
struct RayWorld {
  Eigen::Vector3d origin_world_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitZ();
};

}  // namespace imprint
