#pragma once

#include <Eigen/Core>

#include "lib/geometry/rotation.h"

namespace imprint {

/// Where a camera stands: X_cam = R_cam_world (X_world - center_world_mm).
struct CameraPose {
  Eigen::Matrix3d R_cam_world = Eigen::Matrix3d::Identity();
  Eigen::Vector3d center_world_mm = Eigen::Vector3d::Zero();
  /// Of (center in mm, rotation vector d in rad), 6 x 6; d turns the camera frame: R = exp([d]x) R_cam_world.
  Matrix6d covariance = Matrix6d::Zero();

  [[nodiscard]] Eigen::Vector3d cam_from_world(const Eigen::Vector3d& p_world_mm) const {
    return R_cam_world * (p_world_mm - center_world_mm);
  }
};

}  // namespace imprint
