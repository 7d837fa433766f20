#include "fusion/triangulate/axis_curve.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace imprint {

AxisCurve::Place AxisCurve::at(double x_mm) const {
  const auto count = static_cast<int>(yz_mm.size());
  const double position = (x_mm - x_first_mm) / x_step_mm;
  const int i = std::clamp(static_cast<int>(std::floor(std::clamp(position, -1.0, count + 1.0))), 0, count - 2);
  const double u = std::clamp(position - i, 0.0, 1.0);
  const auto k = static_cast<std::size_t>(i);
  const Eigen::Vector2d beside = (1.0 - u) * yz_mm[k] + u * yz_mm[k + 1];
  const Eigen::Vector2d tilt = (1.0 - u) * slope[k] + u * slope[k + 1];
  // Beyond the samples the axis runs on straight.
  const double beyond = (position - i - u) * x_step_mm;
  const Eigen::Vector2d there = beside + beyond * tilt;
  Place place;
  place.point_mm = origin_mm + R_line.transpose() * Eigen::Vector3d(x_mm, there.x(), there.y());
  place.direction = R_line.transpose() * Eigen::Vector3d(1.0, tilt.x(), tilt.y()).normalized();
  return place;
}

void AxisCurve::set_slopes() {
  const std::size_t n = yz_mm.size();
  slope.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t a = i == 0 ? 0 : i - 1;
    const std::size_t b = std::min(i + 1, n - 1);
    slope[i] = (yz_mm[b] - yz_mm[a]) / (static_cast<double>(b - a) * x_step_mm);
  }
}

AxisCurve straight_axis(const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction, double x_first_mm,
                        double x_last_mm, int samples) {
  AxisCurve axis;
  axis.origin_mm = origin_mm;
  const Eigen::Vector3d x = direction.normalized();
  const Eigen::Vector3d y = x.unitOrthogonal();
  axis.R_line.row(0) = x;
  axis.R_line.row(1) = y;
  axis.R_line.row(2) = x.cross(y);
  axis.x_first_mm = x_first_mm;
  axis.x_step_mm = (x_last_mm - x_first_mm) / (samples - 1);
  axis.yz_mm.assign(static_cast<std::size_t>(samples), Eigen::Vector2d::Zero());
  axis.slope.assign(static_cast<std::size_t>(samples), Eigen::Vector2d::Zero());
  return axis;
}

AxisCurve over(const AxisCurve& axis, double low_mm, double high_mm) {
  AxisCurve stretched = axis;
  const auto samples = static_cast<int>(axis.yz_mm.size());
  stretched.x_first_mm = low_mm;
  stretched.x_step_mm = (high_mm - low_mm) / (samples - 1);
  stretched.yz_mm.clear();
  for (int i = 0; i < samples; ++i) {
    const Eigen::Vector3d p = axis.at(low_mm + i * stretched.x_step_mm).point_mm - axis.origin_mm;
    stretched.yz_mm.emplace_back((axis.R_line * p).tail<2>());
  }
  stretched.set_slopes();
  return stretched;
}

std::optional<RimContact> touch(const AxisCurve& axis, const Eigen::Vector3d& center_mm, const Eigen::Vector3d& ray,
                                double x_guess_mm) {
  RimContact contact;
  contact.x_mm = x_guess_mm;
  for (int iteration = 0; iteration < 4; ++iteration) {
    const AxisCurve::Place place = axis.at(contact.x_mm);
    const Eigen::Vector3d w = center_mm - place.point_mm;
    const double along = ray.dot(place.direction);
    const double across2 = 1.0 - along * along;
    if (across2 < 1e-6) return std::nullopt;
    const double k = (along * place.direction.dot(w) - ray.dot(w)) / across2;
    const Eigen::Vector3d closest = w + k * ray;  // seen from the axis point
    const double step = place.direction.dot(closest) * place.direction.dot(axis.R_line.row(0));
    Eigen::Vector3d normal = ray.cross(place.direction);
    const double length = normal.norm();
    normal /= length;
    double distance = normal.dot(w);
    if (distance < 0.0) {
      normal = -normal;
      distance = -distance;
    }
    contact.normal = normal;
    contact.offset_mm = normal.dot(center_mm);
    contact.distance_mm = distance;
    contact.range_mm = k;
    contact.x_mm += step;
    if (!std::isfinite(contact.x_mm) || k <= 0.0 || distance < 1e-9) return std::nullopt;
    if (std::abs(step) < 1e-6 * (1.0 + std::abs(axis.x_step_mm))) break;
  }
  return contact;
}

std::optional<Eigen::Vector3d> meet_end_circle(const AxisCurve& axis, const Eigen::Vector3d& center_mm,
                                               const Eigen::Vector3d& ray, double radius_mm, bool last,
                                               double x_guess_mm) {
  // End faces stand square to the line rather than to the axis' own slope, which is least sure at the ends.
  const Eigen::Vector3d direction = axis.R_line.row(0);
  double x_mm = x_guess_mm;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int iteration = 0; iteration < 6; ++iteration) {
    const Eigen::Vector3d w = center_mm - axis.at(x_mm).point_mm;
    const double along = ray.dot(direction);
    const double camera_along = w.dot(direction);
    const double a = 1.0 - along * along;
    if (a < 1e-6) return std::nullopt;
    const double b = w.dot(ray) - camera_along * along;
    const double c = w.squaredNorm() - camera_along * camera_along - radius_mm * radius_mm;
    const double discriminant = b * b - a * c;
    if (discriminant < 0.0) return std::nullopt;
    const bool on_bar_side = last ? camera_along < 0.0 : camera_along > 0.0;
    const double k = (-b + (on_bar_side ? -1.0 : 1.0) * std::sqrt(discriminant)) / a;
    if (!(k > 0.0)) return std::nullopt;
    point = center_mm + k * ray;
    const double x_next = axis.x_of(point);
    const double step = x_next - x_mm;
    x_mm = x_next;
    if (std::abs(step) < 1e-7 * (1.0 + radius_mm)) break;
  }
  return point;
}

}  // namespace imprint
