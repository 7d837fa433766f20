#include "tests/paper/calibration/check_targets.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/LU>

namespace imprint::paper {
namespace {

RayWorld ray_to(const PosedView& view, const ObservedPoint& at) {
  const Eigen::Vector3d direction =
      view.pose.R_cam_world.transpose() * ray_direction_cam(view.camera.focal_length_px, undistort(view.camera, at));
  return {view.pose.center_world_mm, direction};
}

// Nearest to both rays.
Eigen::Vector3d intersection(const RayWorld& a, const RayWorld& b) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const RayWorld& ray : {a, b}) {
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray.direction_world * ray.direction_world.transpose();
    matrix += across;
    right += across * ray.origin_world_mm;
  }
  return matrix.inverse() * right;
}

}  // namespace

CheckErrors check_targets(const std::array<PosedView, 2>& views, const TargetField& field,
                          const std::vector<int>& fixed) {
  CheckErrors errors;
  errors.angle_min_deg = 180.0;
  const Eigen::Vector3d middle = 0.5 * (views[0].pose.center_world_mm + views[1].pose.center_world_mm);
  double squares_3d = 0.0, sum = 0.0, squares = 0.0;
  for (const DetectedTarget& first : views[0].targets) {
    const auto known = field.targets.find(first.id);
    const auto second = std::ranges::find(views[1].targets, first.id, &DetectedTarget::id);
    if (known == field.targets.end() || second == views[1].targets.end() ||
        std::ranges::find(fixed, first.id) != fixed.end())
      continue;
    const RayWorld a = ray_to(views[0], first.center), b = ray_to(views[1], second->center);
    const Eigen::Vector3d e = intersection(a, b) - known->second.p_world_mm;
    const Eigen::Vector3d depth = (known->second.p_world_mm - middle).normalized();
    const double e2d = std::numbers::sqrt2 * (e - depth * depth.dot(e)).norm();
    const double angle =
        std::acos(std::clamp(a.direction_world.dot(b.direction_world), -1.0, 1.0)) * 180.0 / std::numbers::pi;
    squares_3d += e.squaredNorm();
    sum += e2d;
    squares += e2d * e2d;
    errors.e2d_max_mm = std::max(errors.e2d_max_mm, e2d);
    errors.angle_min_deg = std::min(errors.angle_min_deg, angle);
    errors.angle_max_deg = std::max(errors.angle_max_deg, angle);
    ++errors.targets;
  }
  if (errors.targets == 0) return {};
  errors.e3d_rms_mm = std::sqrt(squares_3d / errors.targets);
  errors.e2d_mean_mm = sum / errors.targets;
  errors.e2d_rms_mm = std::sqrt(squares / errors.targets);
  return errors;
}

std::vector<int> spread_targets(const std::vector<DetectedTarget>& targets, const TargetField& field, int count) {
  std::vector<DetectedTarget> left;
  for (const DetectedTarget& target : targets)
    if (field.targets.contains(target.id)) left.push_back(target);
  std::vector<DetectedTarget> taken;
  while (static_cast<int>(taken.size()) < count && !left.empty()) {
    double farthest = -1.0;
    std::size_t best = 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      double nearest = std::numeric_limits<double>::max();
      // The first: nearest to a corner, as the one farthest from the middle of the image.
      if (taken.empty()) nearest = std::hypot(left[i].center.x_px - 2327.5, left[i].center.y_px - 1759.5);
      for (const DetectedTarget& t : taken)
        nearest =
            std::min(nearest, std::hypot(left[i].center.x_px - t.center.x_px, left[i].center.y_px - t.center.y_px));
      if (nearest > farthest) farthest = nearest, best = i;
    }
    taken.push_back(left[best]);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
  }
  std::vector<int> ids;
  for (const DetectedTarget& t : taken) ids.push_back(t.id);
  return ids;
}

TargetField only(const TargetField& field, const std::vector<int>& ids) {
  TargetField some;
  for (const int id : ids) some.targets[id] = field.targets.at(id);
  return some;
}

}  // namespace imprint::paper
