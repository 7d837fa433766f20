#include "fusion/combine/tangent_rows.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace imprint {

TangentRows tangent_rows(std::span<const ObservedForging> observations) {
  TangentRows all;
  std::size_t rims = 0;
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const ObservedForging& observed = observations[k];
    for (std::size_t c = 0; c < observed.cameras.size(); ++c) {
      const CameraShare& share = observed.cameras[c];
      if (share.excluded) continue;
      Viewer viewer{.observation = k,
                    .center_world_mm = share.pose.center_world_mm,
                    .pose_covariance = share.pose.covariance,
                    .R_cam_world = share.pose.R_cam_world};
      if (!viewer.pose_covariance.allFinite()) viewer.pose_covariance.setZero();
      viewer.pose_covariance.topLeftCorner<3, 3>().diagonal().array() += std::pow(observed.disagreement_sigma_mm, 2);
      for (const bool upper : {true, false}) {
        for (const ObservedSection& section : observed.sections)
          for (const TangentPlane& tangent : section.tangents)
            if (tangent.camera == static_cast<int>(c) && tangent.upper == upper && tangent.weight > 0.0)
              all.rows.push_back({.viewer = all.viewers.size(),
                                  .rim = rims,
                                  .ray_world = tangent.ray_world,
                                  .variance_mm2 = tangent.sigma_mm * tangent.sigma_mm / tangent.weight,
                                  .x_mm = tangent.s_mm,
                                  .trust = tangent.stray ? 0.0 : 1.0});
        ++rims;
      }
      all.viewers.push_back(viewer);
    }
  }
  std::sort(all.rows.begin(), all.rows.end(), [](const TangentRow& a, const TangentRow& b) { return a.x_mm < b.x_mm; });
  all.rims.resize(rims);
  for (std::size_t r = 0; r < all.rows.size(); ++r) all.rims[all.rows[r].rim].push_back(r);
  return all;
}

void set_place_effects(PlacedEquation& equation, const Eigen::Vector3d& center_mm, const Eigen::Vector3d& point_mm,
                       const Eigen::Vector3d& surface_normal, double length_mm) {
  const Eigen::Vector3d view = point_mm - center_mm;
  equation.camera = surface_normal.dot(view.cross(Eigen::Vector3d::UnitX()).normalized());
  // A move of the observation moves the point on the ray, and with it the value: seen from the model, the other way.
  const Eigen::Vector3d lever = point_mm - Eigen::Vector3d(0.5 * length_mm, 0.0, 0.0);
  equation.place.head<3>() = -surface_normal;
  equation.place.tail<3>() = surface_normal.cross(lever);
}

std::optional<TangentEquation> equation_of(TangentRow& row, const ViewerPlaces& places, const RodSurface& rod,
                                           double length_mm, double margin_mm) {
  const Eigen::Vector3d center = places.center_of(row.viewer);
  const auto contact = rod.touch(center, places.placement_of(row.viewer).R * row.ray_world, row.x_mm);
  if (!contact) return std::nullopt;
  row.x_mm = contact->nearest_x_mm;
  if (row.x_mm < margin_mm || row.x_mm > length_mm - margin_mm) return std::nullopt;
  TangentEquation equation;
  equation.node = contact->node;
  equation.share = contact->share;
  equation.along = std::clamp(contact->x_mm / length_mm, 0.0, 1.0);
  equation.value_mm = contact->value_mm;
  equation.x_per_mm = contact->x_per_mm;
  NodeVector& g = equation.coefficients;
  g(kY) = contact->normal.x();
  g(kZ) = contact->normal.y();
  g(kRadius) = 1.0;
  g.tail<2 * kHarmonics>() = contact->harmonics;
  set_place_effects(equation, center, contact->point_mm, contact->surface_normal, length_mm);
  return equation;
}

double end_margin_mm(double step_mm, double end_sigma_mm, double radius_mm) {
  constexpr double kMost = 0.2;  // of the radius
  return step_mm + std::min(2.0 * end_sigma_mm, kMost * radius_mm);
}

double rim_scatter(const TangentRows& tangents, std::span<const std::optional<double>> off_mm) {
  constexpr std::size_t kApart = 8;  // stations: some 25 px
  std::vector<double> bends;
  for (const std::vector<std::size_t>& rim : tangents.rims) {
    for (std::size_t i = 0; i + 2 * kApart < rim.size(); ++i) {
      const std::size_t a = rim[i], b = rim[i + kApart], c = rim[i + 2 * kApart];
      const TangentRow& row = tangents.rows[b];
      if (!(tangents.rows[a].trust > 0.0 && row.trust > 0.0 && tangents.rows[c].trust > 0.0)) continue;
      if (!off_mm[a] || !off_mm[b] || !off_mm[c]) continue;
      bends.push_back(std::abs(*off_mm[a] - 2.0 * *off_mm[b] + *off_mm[c]) / std::sqrt(row.variance_mm2));
    }
  }
  if (bends.empty()) return 1.0;
  const auto middle = bends.begin() + static_cast<std::ptrdiff_t>(bends.size() / 2);
  std::nth_element(bends.begin(), middle, bends.end());
  return 1.4826 * *middle / std::sqrt(6.0);
}

double moved_together(const TangentRows& tangents, double noise_scale) {
  constexpr std::size_t kFurthest = 120;  // stations
  constexpr double kNone = 0.05, kMost = 2.5;
  double squares = 0.0, count = 0.0;
  // What belongs to something else is no measure of what moves the rims.
  std::vector<std::vector<std::optional<double>>> sizes;
  for (const std::vector<std::size_t>& rim : tangents.rims) {
    std::vector<std::optional<double>>& along = sizes.emplace_back();
    for (const std::size_t r : rim) {
      const TangentRow& row = tangents.rows[r];
      along.emplace_back();
      if (!row.used) continue;
      const double size = row.residual_mm * std::sqrt(row.trust / row.variance_mm2) / noise_scale;
      along.back() = std::clamp(size, -kMost, kMost);
      squares += *along.back() * *along.back(), count += 1.0;
    }
  }
  if (!(squares > 0.0)) return 1.0;
  double sum = 1.0;
  for (std::size_t lag = 1; lag < kFurthest; lag += 1 + lag / 8) {
    double products = 0.0, pairs = 0.0;
    for (const auto& along : sizes) {
      for (std::size_t i = lag; i < along.size(); ++i) {
        if (!along[i] || !along[i - lag]) continue;
        products += *along[i] * *along[i - lag], pairs += 1.0;
      }
    }
    const double likeness = pairs > 0.0 ? products / pairs / (squares / count) : 0.0;
    if (likeness < kNone) break;
    sum += 2.0 * likeness * static_cast<double>(1 + lag / 8);
  }
  return sum;
}

}  // namespace imprint
