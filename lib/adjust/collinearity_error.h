#pragma once

#include <ceres/rotation.h>

#include "lib/camera/balanced_distortion.h"
#include "lib/geometry/points.h"

namespace imprint {

/// [B] equation 1 for one target in one image, in standard deviations of its centre; a cost function for Ceres.
/// Parameters: the ten constants of kInteriorNames; the camera's turn (angle and axis of R_cam_world); its centre; the
/// target (both in the world, one unit of length). False when the target lies behind the camera.
struct CollinearityError {
  ObservedPoint at;
  double sigma_px, n_px, r0;

  template <class T>
  bool operator()(const T* interior, const T* turn, const T* center, const T* point, T* residual) const {
    const T from_center[3] = {point[0] - center[0], point[1] - center[1], point[2] - center[2]};
    T p[3];
    ceres::AngleAxisRotatePoint(turn, from_center, p);
    if (!(p[2] > T(0))) return false;
    const T scale = interior[0] / (p[2] * n_px);
    const auto [u, v] = distort_balanced(interior + 3, r0, T(p[0] * scale), T(p[1] * scale));
    residual[0] = (at.x_px - interior[1] - n_px * u) / sigma_px;
    residual[1] = (at.y_px - interior[2] - n_px * v) / sigma_px;
    return true;
  }
};

}  // namespace imprint
