#include "lib/camera/camera_model.h"

#include <cmath>

#include <Eigen/LU>

#include "lib/camera/balanced_distortion.h"

namespace imprint {
namespace {

struct Normalized {
  double u, v;
};

Normalized distort_normalized(const BalancedDistortion& d, Normalized p) {
  const auto [u, v] = distort_balanced(d.terms().data(), d.r0, p.u, p.v);
  return {u, v};
}

Eigen::Matrix2d jacobian_normalized(const BalancedDistortion& d, Normalized p) {
  const double q = d.r0 * d.r0;
  const double r2 = p.u * p.u + p.v * p.v;
  const double radial =
      d.radial[0] * (r2 - q) + d.radial[1] * (r2 * r2 - q * q) + d.radial[2] * (r2 * r2 * r2 - q * q * q);
  const double slope = d.radial[0] + 2 * d.radial[1] * r2 + 3 * d.radial[2] * r2 * r2;  // d(radial)/d(r^2)
  const double b1 = d.tangential[0], b2 = d.tangential[1];
  Eigen::Matrix2d j;
  j(0, 0) = 1 + radial + 2 * p.u * p.u * slope + 6 * b1 * p.u + 2 * b2 * p.v + d.affine[0];
  j(0, 1) = 2 * p.u * p.v * slope + 2 * b1 * p.v + 2 * b2 * p.u + d.affine[1];
  j(1, 0) = 2 * p.u * p.v * slope + 2 * b2 * p.u + 2 * b1 * p.v;
  j(1, 1) = 1 + radial + 2 * p.v * p.v * slope + 6 * b2 * p.v + 2 * b1 * p.u;
  return j;
}

}  // namespace

ObservedPoint distort(const CameraModel& camera, const IdealPoint& p) {
  const double n = camera.normalizer_px();
  const Normalized d = distort_normalized(camera.distortion, {p.x_px / n, p.y_px / n});
  return {camera.principal_point.x_px + n * d.u, camera.principal_point.y_px + n * d.v};
}

Eigen::Matrix2d distortion_jacobian(const CameraModel& camera, const IdealPoint& p) {
  const double n = camera.normalizer_px();
  return jacobian_normalized(camera.distortion, {p.x_px / n, p.y_px / n});
}

IdealPoint undistort(const CameraModel& camera, const ObservedPoint& p) {
  const double n = camera.normalizer_px();
  const Normalized target{(p.x_px - camera.principal_point.x_px) / n, (p.y_px - camera.principal_point.y_px) / n};
  Normalized x = target;
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Normalized at = distort_normalized(camera.distortion, x);
    const Eigen::Vector2d residual(target.u - at.u, target.v - at.v);
    const Eigen::Vector2d step = jacobian_normalized(camera.distortion, x).inverse() * residual;
    x.u += step.x();
    x.v += step.y();
    if (step.squaredNorm() * n * n < 1e-20) break;
  }
  return {x.u * n, x.v * n};
}

IdealPoint project_ideal(const CameraModel& camera, const Eigen::Vector3d& p_cam_mm) {
  const double f = camera.focal_length_px;
  return {f * p_cam_mm.x() / p_cam_mm.z(), f * p_cam_mm.y() / p_cam_mm.z()};
}

ObservedPoint project(const CameraModel& camera, const Eigen::Vector3d& p_cam_mm) {
  return distort(camera, project_ideal(camera, p_cam_mm));
}

Eigen::Vector3d ray_direction_cam(double focal_length_px, const IdealPoint& p) {
  return Eigen::Vector3d(p.x_px, p.y_px, focal_length_px).normalized();
}

}  // namespace imprint
