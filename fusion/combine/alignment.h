#pragma once

#include <span>

#include <Eigen/Core>

#include "fusion/triangulate/triangulate.h"

namespace imprint {

/// X_to = R (X_from) + shift_mm.
struct Placement {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d point(const Eigen::Vector3d& p) const { return R * p + shift_mm; }
};

/// The forging's axes in the world (contract section 1): rows x along `axis_direction`; z the world's z made
/// perpendicular to x, or the world's y where x is within 10 degrees of the world's z; y = z x x.
Eigen::Matrix3d forging_axes(const Eigen::Vector3d& axis_direction);

/// The ideal axis: least-squares line through all axis points of both end sections ([D] 2.1.3), as
/// y = mean + slope (x - x_mean) and z likewise.
struct IdealAxis {
  double x_mean_mm = 0.0;
  Eigen::Vector2d mean_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  std::vector<double> level_weight;  ///< one a point: mean = sum of weight times value
  std::vector<double> slope_weight;  ///< one a point: slope = sum of weight times value

  [[nodiscard]] Eigen::Vector3d at(double x_mm) const {
    const Eigen::Vector2d yz = mean_mm + slope * (x_mm - x_mean_mm);
    return {x_mm, yz.x(), yz.y()};
  }
};

/// `x_mm` ascending and `yz_mm` beside it; the end sections reach from `first_mm` and `last_mm` inwards. A forging
/// shorter than two end sections is taken whole.
IdealAxis ideal_axis(std::span<const double> x_mm, std::span<const Eigen::Vector2d> yz_mm, double first_mm,
                     double last_mm, double end_section_mm);

/// Pre-alignment of one observation: from the world to its own forging frame.
Placement pre_align(const ObservedForging& observed, double end_section_mm);

/// Turn by `angle_rad` about x, right-handed.
Eigen::Matrix3d turn_about_x(double angle_rad);

}  // namespace imprint
