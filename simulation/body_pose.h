#pragma once

#include <Eigen/Core>

namespace imprint {

/// Where the body lies in one observation: X_world = R_world_body X_body + origin_world_mm.
struct BodyPose {
  Eigen::Matrix3d R_world_body = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_world_mm = Eigen::Vector3d::Zero();  ///< the body's (0, 0, 0): ideal axis at the first end
  double true_rotation_deg = 0.0;
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();  ///< positioning error of the middle

  [[nodiscard]] Eigen::Vector3d world_from_body(const Eigen::Vector3d& p_body_mm) const {
    return R_world_body * p_body_mm + origin_world_mm;
  }
  [[nodiscard]] Eigen::Vector3d body_from_world(const Eigen::Vector3d& p_world_mm) const {
    return R_world_body.transpose() * (p_world_mm - origin_world_mm);
  }
};

}  // namespace imprint
