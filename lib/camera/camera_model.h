#pragma once

#include <array>
#include <string>

#include <Eigen/Core>

#include "lib/geometry/points.h"

namespace imprint {

/// Balanced radial, tangential and affine distortion, [B] equation 2 with the contract's mending.
struct BalancedDistortion {
  double r0 = 2.0 / 3.0;
  std::array<double, 3> radial{};      // A1, A2, A3
  std::array<double, 2> tangential{};  // B1, B2
  std::array<double, 2> affine{};      // C1, C2

  [[nodiscard]] std::array<double, 7> terms() const {
    return {radial[0], radial[1], radial[2], tangential[0], tangential[1], affine[0], affine[1]};
  }
};

/// One camera's interior orientation; the model of contract section 1.
struct CameraModel {
  std::string id;
  int width_px = 0;
  int height_px = 0;
  double pixel_pitch_um = 0.0;
  double focal_length_px = 0.0;
  ObservedPoint principal_point;
  BalancedDistortion distortion;

  /// Half the shorter side in px: the unit of the distortion polynomial.
  [[nodiscard]] double normalizer_px() const { return 0.5 * (width_px < height_px ? width_px : height_px); }
};

/// Where the camera shows the ideal point `p`: observed point = principal point + n (u + du), [B] equation 2.
ObservedPoint distort(const CameraModel& camera, const IdealPoint& p);

/// d(observed)/d(ideal) at `p`, dimensionless (px/px).
Eigen::Matrix2d distortion_jacobian(const CameraModel& camera, const IdealPoint& p);

/// The ideal point that the camera shows at `p`: the inverse of `distort` by Newton's method, to 1e-9 px
/// ([B] equation 6 iterates a fixed point instead).
IdealPoint undistort(const CameraModel& camera, const ObservedPoint& p);

/// The ideal image point of `p_cam_mm` (camera axes, mm); z must be positive.
IdealPoint project_ideal(const CameraModel& camera, const Eigen::Vector3d& p_cam_mm);

/// Where the camera shows `p_cam_mm` (camera axes, mm); z must be positive.
ObservedPoint project(const CameraModel& camera, const Eigen::Vector3d& p_cam_mm);

/// Direction in camera axes, length 1, of the ray through an ideal image point.
Eigen::Vector3d ray_direction_cam(double focal_length_px, const IdealPoint& p);

}  // namespace imprint
