#include "fusion/triangulate/first_axis.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Dense>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
};

/// Distance of two skew rays, [D] equation 2.
double ray_distance(const Ray& a, const Ray& b) {
  const Eigen::Vector3d across = a.direction.cross(b.direction);
  const double sine = across.norm();
  if (sine < 1e-9) return (b.origin - a.origin).cross(a.direction).norm();
  return std::abs((b.origin - a.origin).dot(across)) / sine;
}

struct AxisRay {
  Eigen::Vector3d direction;
  double station;
};

/// The ray of `view` closest to `ray`: where the signed volume of [D] equation 2 changes its sign.
std::optional<AxisRay> closest_axis_ray(const CameraView& view, const Ray& ray) {
  const Eigen::Vector3d plane = (view.pose.center_world_mm - ray.origin).cross(ray.direction);
  const double scale = plane.norm();
  if (scale < 1e-9) return std::nullopt;
  int before = -1;
  double volume_before = 0.0;
  int best = -1;
  double best_volume = 0.0;
  for (int i = 0; i < static_cast<int>(view.axis.size()); ++i) {
    const CurveRay& candidate = view.axis[static_cast<std::size_t>(i)];
    if (candidate.weight <= 0.0) continue;
    const double volume = plane.dot(candidate.direction_world) / scale;
    if (before >= 0 && volume * volume_before <= 0.0 && volume != volume_before) {
      const double u = volume_before / (volume_before - volume);
      const Eigen::Vector3d& a = view.axis[static_cast<std::size_t>(before)].direction_world;
      return AxisRay{((1.0 - u) * a + u * candidate.direction_world).normalized(), before + u * (i - before)};
    }
    if (best < 0 || std::abs(volume) < std::abs(best_volume)) {
      best = i;
      best_volume = volume;
    }
    before = i;
    volume_before = volume;
  }
  // No crossing: the ray looks past this camera's curve; only a near miss of its end counts.
  if (best < 0 || std::abs(best_volume) > 1e-3) return std::nullopt;
  return AxisRay{view.axis[static_cast<std::size_t>(best)].direction_world, static_cast<double>(best)};
}

/// The point nearest to all rays, [D] equation 3 by least squares; nothing where it lies behind a camera.
std::optional<Eigen::Vector3d> nearest_point(std::span<const Ray> rays) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Ray& ray : rays) {
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose();
    normal += across;
    right += across * ray.origin;
  }
  if (std::abs(normal.determinant()) < 1e-9) return std::nullopt;
  const Eigen::Vector3d point = normal.ldlt().solve(right);
  for (const Ray& ray : rays)
    if ((point - ray.origin).dot(ray.direction) <= 0.0) return std::nullopt;
  return point;
}

}  // namespace

std::vector<AxisGroup> group_axis_rays(std::span<const CameraView> views, double max_distance_mm) {
  std::vector<AxisGroup> groups;
  if (views.size() < 2) return groups;
  const auto seen = [](const CameraView& view) {
    return std::count_if(view.axis.begin(), view.axis.end(), [](const CurveRay& ray) { return ray.weight > 0.0; });
  };
  const auto primary = static_cast<std::size_t>(
      std::max_element(views.begin(), views.end(), [&](const auto& a, const auto& b) { return seen(a) < seen(b); }) -
      views.begin());
  std::vector<Ray> rays;
  for (std::size_t station = 0; station < views[primary].axis.size(); ++station) {
    const CurveRay& axis_ray = views[primary].axis[station];
    if (axis_ray.weight <= 0.0) continue;
    AxisGroup group;
    group.members.push_back({primary, static_cast<double>(station)});
    rays.assign(1, Ray{views[primary].pose.center_world_mm, axis_ray.direction_world});
    for (std::size_t v = 0; v < views.size(); ++v) {
      if (v == primary) continue;
      const auto closest = closest_axis_ray(views[v], rays.front());
      if (!closest) continue;
      group.members.push_back({v, closest->station});
      rays.push_back(Ray{views[v].pose.center_world_mm, closest->direction});
    }
    if (rays.size() < 2) continue;
    double widest = 0.0;
    for (std::size_t i = 0; i < rays.size(); ++i)
      for (std::size_t j = i + 1; j < rays.size(); ++j) widest = std::max(widest, ray_distance(rays[i], rays[j]));
    if (widest > max_distance_mm) continue;
    const auto point = nearest_point(rays);
    if (!point) continue;
    group.point_mm = *point;
    groups.push_back(std::move(group));
  }
  return groups;
}

std::vector<Eigen::Vector3d> triangulate_axis_points(std::span<const CameraView> views, double max_distance_mm) {
  std::vector<Eigen::Vector3d> points;
  for (const AxisGroup& group : group_axis_rays(views, max_distance_mm)) points.push_back(group.point_mm);
  return points;
}

Result<AxisCurve> line_through(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& axis_direction,
                               int samples) {
  if (points.size() < 10)
    return job_failed("the axis imprints of the cameras meet in {} points, at least 10 needed: check the poses",
                      points.size());
  std::vector<double> weight(points.size(), 1.0);
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = axis_direction;
  std::vector<double> distance(points.size());
  for (int iteration = 0; iteration < 8; ++iteration) {
    double total = 0.0;
    center.setZero();
    for (std::size_t i = 0; i < points.size(); ++i) {
      center += weight[i] * points[i];
      total += weight[i];
    }
    center /= total;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d d = points[i] - center;
      spread += weight[i] * d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    if (solver.info() != Eigen::Success || !(solver.eigenvalues()(2) > 4.0 * solver.eigenvalues()(1)))
      return job_failed("the axis points of the cameras form no line: check the poses and the imprints");
    direction = solver.eigenvectors().col(2);
    for (std::size_t i = 0; i < points.size(); ++i) distance[i] = (points[i] - center).cross(direction).norm();
    const double scale = std::max(2.0 * median(distance), 1e-6);
    for (std::size_t i = 0; i < points.size(); ++i) weight[i] = 1.0 / (1.0 + std::pow(distance[i] / scale, 2));
  }
  if (direction.dot(axis_direction) < 0.0) direction = -direction;
  double first = 0.0;
  double last = 0.0;
  for (const Eigen::Vector3d& point : points) {
    first = std::min(first, (point - center).dot(direction));
    last = std::max(last, (point - center).dot(direction));
  }
  return straight_axis(center, direction, first, last, samples);
}

}  // namespace imprint
