#include "fusion/triangulate/section_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "fusion/triangulate/savitzky_golay.h"

namespace imprint {
namespace {

struct SectionRow {
  Eigen::Vector3d coefficients;  ///< n_y, n_z, 1
  double distance_mm;
  double weight;
  std::size_t rim;  ///< view * 2 + upper
};

FittedCircle fit_circle(std::span<const SectionRow> rows, std::size_t rims) {
  FittedCircle circle;
  std::vector<char> present(rims, 0);
  for (const SectionRow& row : rows) present[row.rim] = 1;
  circle.rims = static_cast<int>(std::count(present.begin(), present.end(), 1));
  if (!circle.fitted()) return circle;
  Eigen::Vector3d solution = Eigen::Vector3d::Zero();
  std::vector<double> trust(rows.size(), 1.0);
  for (int iteration = 0; iteration < 4; ++iteration) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double total = 0.0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double w = rows[i].weight * trust[i];
      normal += w * rows[i].coefficients * rows[i].coefficients.transpose();
      right += w * rows[i].coefficients * rows[i].distance_mm;
      total += w;
    }
    // One camera alone says nothing of the depth: the centre then stays on the axis curve.
    normal.topLeftCorner<2, 2>().diagonal().array() += 1e-6 * total;
    solution = normal.ldlt().solve(right);
    // Out-of-round belongs to the section; only what lies far outside it is a fault (Cauchy weights).
    const double scale = std::max(0.02 * std::abs(solution.z()), 1e-9);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double residual = rows[i].distance_mm - rows[i].coefficients.dot(solution);
      trust[i] = 1.0 / (1.0 + std::pow(residual / scale, 2));
    }
  }
  circle.shift_mm = solution.head<2>();
  circle.radius_mm = solution.z();
  if (!solution.allFinite() || circle.radius_mm <= 0.0) circle.rims = 0;
  return circle;
}

}  // namespace

std::vector<RimTangent> rim_tangents(std::span<const CameraView> views, const AxisCurve& axis) {
  std::vector<RimTangent> tangents;
  tangents.reserve(views.size() * 2 * kImprintStations);
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (const bool upper : {true, false}) {
      double x_guess = axis.x_first_mm + 0.5 * axis.x_step_mm * static_cast<double>(axis.yz_mm.size() - 1);
      for (const CurveRay& ray : upper ? views[v].upper : views[v].lower) {
        if (ray.weight <= 0.0) continue;
        const auto contact = touch(axis, views[v].pose.center_world_mm, ray.direction_world, x_guess);
        if (!contact) continue;
        x_guess = contact->x_mm;
        tangents.push_back({.view = v,
                            .upper = upper,
                            .ray = ray.direction_world,
                            .weight = ray.weight,
                            .mm_per_px = contact->range_mm / views[v].focal_length_px,
                            .contact = *contact});
      }
    }
  }
  return tangents;
}

std::vector<FittedCircle> fit_circles(const AxisCurve& axis, std::span<const RimTangent> tangents) {
  const auto samples = static_cast<int>(axis.yz_mm.size());
  std::vector<std::vector<SectionRow>> rows(axis.yz_mm.size());
  std::size_t rims = 0;
  for (const RimTangent& tangent : tangents) {
    rims = std::max(rims, 2 * tangent.view + 2);
    const double position = (tangent.contact.x_mm - axis.x_first_mm) / axis.x_step_mm;
    if (!(position > -2.0 && position < samples + 2.0)) continue;
    const Eigen::Vector3d normal = axis.R_line * tangent.contact.normal;
    const int nearest = static_cast<int>(std::lround(position));
    for (int i = std::max(0, nearest - 1); i <= std::min(samples - 1, nearest + 1); ++i) {
      const double closeness = 1.0 - std::abs(position - i) / 1.5;
      if (closeness <= 0.0) continue;
      rows[static_cast<std::size_t>(i)].push_back({.coefficients = {normal.y(), normal.z(), 1.0},
                                                   .distance_mm = tangent.contact.distance_mm,
                                                   .weight = tangent.weight * closeness,
                                                   .rim = 2 * tangent.view + (tangent.upper ? 1 : 0)});
    }
  }
  std::vector<FittedCircle> circles(axis.yz_mm.size());
  for (std::size_t i = 0; i < circles.size(); ++i) circles[i] = fit_circle(rows[i], rims);
  return circles;
}

AxisCurve moved_axis(const AxisCurve& axis, std::span<const FittedCircle> circles, int window) {
  AxisCurve moved = axis;
  const std::size_t n = circles.size();
  std::vector<double> y(n), z(n), weight(n, 0.0);
  std::vector<std::size_t> fitted;
  for (std::size_t i = 0; i < n; ++i)
    if (circles[i].fitted()) fitted.push_back(i);
  if (fitted.empty()) return moved;
  std::size_t next = 0;
  for (std::size_t i = 0; i < n; ++i) {
    // A sample without a circle moves with its nearest neighbour that has one.
    while (next + 1 < fitted.size() && fitted[next + 1] <= i) ++next;
    std::size_t source = fitted[next];
    if (next + 1 < fitted.size() && fitted[next + 1] - i < (i > source ? i - source : source - i))
      source = fitted[next + 1];
    y[i] = axis.yz_mm[i].x() + circles[source].shift_mm.x();
    z[i] = axis.yz_mm[i].y() + circles[source].shift_mm.y();
    weight[i] = circles[i].fitted() ? 1.0 : 1e-3;
  }
  const std::vector<double> y_smooth = savitzky_golay(y, weight, window);
  const std::vector<double> z_smooth = savitzky_golay(z, weight, window);
  for (std::size_t i = 0; i < n; ++i) moved.yz_mm[i] = {y_smooth[i], z_smooth[i]};
  moved.set_slopes();
  return moved;
}

}  // namespace imprint
