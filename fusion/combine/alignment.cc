#include "fusion/combine/alignment.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace imprint {

Eigen::Matrix3d forging_axes(const Eigen::Vector3d& axis_direction) {
  const Eigen::Vector3d x = axis_direction.normalized();
  const double cos_10_deg = std::cos(10.0 * M_PI / 180.0);
  const Eigen::Vector3d up = std::abs(x.z()) > cos_10_deg ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d z = (up - up.dot(x) * x).normalized();
  Eigen::Matrix3d axes;
  axes.row(0) = x;
  axes.row(1) = z.cross(x);
  axes.row(2) = z;
  return axes;
}

IdealAxis ideal_axis(std::span<const double> x_mm, std::span<const Eigen::Vector2d> yz_mm, double first_mm,
                     double last_mm, double end_section_mm) {
  IdealAxis axis;
  const std::size_t n = x_mm.size();
  axis.level_weight.assign(n, 0.0);
  axis.slope_weight.assign(n, 0.0);
  axis.x_mean_mm = 0.5 * (first_mm + last_mm);
  const double reach = std::min(end_section_mm, 0.5 * (last_mm - first_mm));
  // Points spread evenly over both end sections, between the given ones, so that the line does not depend on which
  // of those happen to lie inside.
  constexpr int kPoints = 40;
  const double spread = [&] {
    double sum = 0.0;
    for (int i = 0; i < kPoints; ++i)
      sum += 2.0 * std::pow(0.5 * (last_mm - first_mm) - reach * (i + 0.5) / kPoints, 2);
    return sum;
  }();
  std::size_t k = 0;
  for (int i = 0; i < 2 * kPoints; ++i) {
    const bool in_first = i < kPoints;
    const double share = ((in_first ? i : i - kPoints) + 0.5) / kPoints;
    const double x = in_first ? first_mm + reach * share : last_mm - reach * (1.0 - share);
    while (k + 2 < n && x_mm[k + 1] < x) ++k;
    const double u = (x - x_mm[k]) / (x_mm[k + 1] - x_mm[k]);
    const double level = 0.5 / kPoints;
    const double slope = (x - axis.x_mean_mm) / spread;
    axis.level_weight[k] += (1.0 - u) * level;
    axis.level_weight[k + 1] += u * level;
    axis.slope_weight[k] += (1.0 - u) * slope;
    axis.slope_weight[k + 1] += u * slope;
  }
  for (std::size_t i = 0; i < n; ++i) {
    axis.mean_mm += axis.level_weight[i] * yz_mm[i];
    axis.slope += axis.slope_weight[i] * yz_mm[i];
  }
  return axis;
}

Placement pre_align(const ObservedForging& observed, double end_section_mm) {
  // First along the chord, then along the line through the end sections.
  Placement placement;
  placement.R = forging_axes(observed.end_world_mm - observed.start_world_mm);
  placement.shift_mm = -placement.R * observed.start_world_mm;
  std::vector<double> x;
  std::vector<Eigen::Vector2d> yz;
  for (const ObservedSection& section : observed.sections) {
    const Eigen::Vector3d p = placement.point(section.axis_world_mm);
    x.push_back(p.x());
    yz.emplace_back(p.y(), p.z());
  }
  const double length = placement.point(observed.end_world_mm).x();
  const IdealAxis line = ideal_axis(x, yz, 0.0, length, end_section_mm);
  const Eigen::Vector3d direction = placement.R.transpose() * Eigen::Vector3d(1.0, line.slope.x(), line.slope.y());
  const Eigen::Vector3d origin = placement.R.transpose() * (line.at(0.0) - placement.shift_mm);
  placement.R = forging_axes(direction);
  placement.shift_mm = -placement.R * origin;
  return placement;
}

Eigen::Matrix3d turn_about_x(double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitX()).toRotationMatrix();
}

}  // namespace imprint
