#include "lib/geometry/rotation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace imprint {

Eigen::Matrix3d rotation_from_omega_phi_kappa(const Eigen::Vector3d& angles) {
  // [B] equation 4 is Rx(omega) Ry(phi) Rz(kappa).
  return (Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

Eigen::Vector3d omega_phi_kappa_from_rotation(const Eigen::Matrix3d& R) {
  return {std::atan2(-R(1, 2), R(2, 2)), std::asin(std::clamp(R(0, 2), -1.0, 1.0)), std::atan2(-R(0, 1), R(0, 0))};
}

Eigen::Matrix3d rotation_from_vector(const Eigen::Vector3d& w_rad) {
  const double angle = w_rad.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity() + cross_matrix(w_rad);
  return Eigen::AngleAxisd(angle, w_rad / angle).toRotationMatrix();
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& w) {
  Eigen::Matrix3d m;
  m << 0.0, -w.z(), w.y(), w.z(), 0.0, -w.x(), -w.y(), w.x(), 0.0;
  return m;
}

}  // namespace imprint
