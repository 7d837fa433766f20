#pragma once

#include <optional>
#include <vector>

#include "lib/geometry/points.h"

namespace imprint {

/// Where rays meet, and which of them do.
struct Intersection {
  Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();
  std::vector<bool> agrees;  ///< by ray
  double angle_rad = 0.0;    ///< widest between two agreeing rays
};

/// The point that most rays pass within `tolerance_rad` of, as seen from their origins: the best of the pairs of rays,
/// then least squares over the rays that agree. Nothing when no two rays that meet at `min_angle_rad` or more agree.
std::optional<Intersection> intersect_rays(const std::vector<RayWorld>& rays, double tolerance_rad,
                                           double min_angle_rad);

}  // namespace imprint
