#include "survey/intersect_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace imprint {
namespace {

// Least squares of the distances to the rays, each divided by its length up to `near`.
std::optional<Eigen::Vector3d> meeting_point(const std::vector<RayWorld>& rays, const std::vector<bool>& wanted,
                                             const std::optional<Eigen::Vector3d>& near) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!wanted[i]) continue;
    const Eigen::Vector3d& d = rays[i].direction_world;
    const double weight = near ? 1.0 / (*near - rays[i].origin_world_mm).squaredNorm() : 1.0;
    const Eigen::Matrix3d across = weight * (Eigen::Matrix3d::Identity() - d * d.transpose());
    matrix += across;
    right += across * rays[i].origin_world_mm;
  }
  const Eigen::Vector3d p = matrix.ldlt().solve(right);
  if (!p.allFinite()) return std::nullopt;
  return p;
}

double angle_off(const RayWorld& ray, const Eigen::Vector3d& p) {
  const Eigen::Vector3d to = p - ray.origin_world_mm;
  return std::atan2(to.cross(ray.direction_world).norm(), to.dot(ray.direction_world));
}

double angle_between(const RayWorld& a, const RayWorld& b) {
  return std::atan2(a.direction_world.cross(b.direction_world).norm(), a.direction_world.dot(b.direction_world));
}

struct Consensus {
  std::vector<bool> agrees;
  int count = 0;
  double cost = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool better_than(const Consensus& other) const {
    return count != other.count ? count > other.count : cost < other.cost;
  }
};

Consensus consensus_on(const Eigen::Vector3d& p, const std::vector<RayWorld>& rays, double tolerance_rad) {
  Consensus result{std::vector<bool>(rays.size(), false), 0, 0.0};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double off = angle_off(rays[i], p);
    if (off < tolerance_rad) {
      result.agrees[i] = true;
      ++result.count;
    }
    result.cost += std::min(off, tolerance_rad);
  }
  return result;
}

}  // namespace

std::optional<Intersection> intersect_rays(const std::vector<RayWorld>& rays, double tolerance_rad,
                                           double min_angle_rad) {
  Consensus best;
  std::optional<Eigen::Vector3d> point;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (angle_between(rays[i], rays[j]) < min_angle_rad) continue;
      std::vector<bool> pair(rays.size(), false);
      pair[i] = pair[j] = true;
      const auto p = meeting_point(rays, pair, std::nullopt);
      if (!p) continue;
      Consensus consensus = consensus_on(*p, rays, tolerance_rad);
      if (consensus.agrees[i] && consensus.agrees[j] && consensus.better_than(best)) {
        best = std::move(consensus);
        point = p;
      }
    }
  }
  if (!point) return std::nullopt;
  if (const auto all = meeting_point(rays, best.agrees, point)) {
    Consensus consensus = consensus_on(*all, rays, tolerance_rad);
    if (consensus.better_than(best)) {
      best = std::move(consensus);
      point = all;
    }
  }
  Intersection result{*point, best.agrees, 0.0};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (best.agrees[i] && best.agrees[j])
        result.angle_rad = std::max(result.angle_rad, angle_between(rays[i], rays[j]));
    }
  }
  return result;
}

}  // namespace imprint
