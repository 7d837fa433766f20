#pragma once

#include <span>

#include <Eigen/Core>

namespace imprint {

/// Diameter of the narrowest straight cylinder that holds the axis: straightness by minimum zone (ISO 12780-1). Exact
/// to 0.1 %. `s_mm` ascending, `axis_mm` the axis beside a straight line there.
double minimum_zone_mm(std::span<const double> s_mm, std::span<const Eigen::Vector2d> axis_mm);

/// How far the axis lies from the straight line between the ends of any stretch of `stretch_mm` (of the whole, when
/// that is shorter), at most.
double bow_over_mm(std::span<const double> s_mm, std::span<const Eigen::Vector2d> axis_mm, double stretch_mm);

}  // namespace imprint
