#include "fusion/combine/tangent_rows.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace imprint {

TangentRows tangent_rows(std::span<const ObservedForging> observations) {
  TangentRows all;
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
        const std::size_t first = all.rows.size();
        for (const ObservedSection& section : observed.sections)
          for (const TangentPlane& tangent : section.tangents)
            if (tangent.camera == static_cast<int>(c) && tangent.upper == upper && tangent.weight > 0.0)
              all.rows.push_back({.viewer = all.viewers.size(),
                                  .ray_world = tangent.ray_world,
                                  .variance_mm2 = tangent.sigma_mm * tangent.sigma_mm / tangent.weight,
                                  .x_mm = tangent.s_mm,
                                  .trust = tangent.stray ? 0.0 : 1.0});
        std::sort(all.rows.begin() + static_cast<std::ptrdiff_t>(first), all.rows.end(),
                  [](const TangentRow& a, const TangentRow& b) { return a.x_mm < b.x_mm; });
        for (std::size_t i = first + 1; i < all.rows.size(); ++i) all.rows[i].continues = true;
      }
      all.viewers.push_back(viewer);
    }
  }
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

double rim_scatter(std::span<const TangentRow> rows, std::span<const std::optional<double>> off_mm) {
  constexpr std::size_t kApart = 8;  // stations: some 25 px
  std::vector<double> bends;
  for (std::size_t r = 0; r + 2 * kApart < rows.size(); ++r) {
    bool same_rim = true;
    for (std::size_t k = r + 1; k <= r + 2 * kApart && same_rim; ++k) same_rim = rows[k].continues;
    const TangentRow &a = rows[r], &b = rows[r + kApart], &c = rows[r + 2 * kApart];
    if (!same_rim || !(a.trust > 0.0 && b.trust > 0.0 && c.trust > 0.0)) continue;
    const auto &first = off_mm[r], &middle = off_mm[r + kApart], &last = off_mm[r + 2 * kApart];
    if (!first || !middle || !last) continue;
    bends.push_back(std::abs(*first - 2.0 * *middle + *last) / std::sqrt(b.variance_mm2));
  }
  if (bends.empty()) return 1.0;
  const auto middle = bends.begin() + static_cast<std::ptrdiff_t>(bends.size() / 2);
  std::nth_element(bends.begin(), middle, bends.end());
  return 1.4826 * *middle / std::sqrt(6.0);
}

double moved_together(std::span<const TangentRow> rows, double noise_scale) {
  constexpr std::size_t kFurthest = 120;  // stations
  constexpr double kNone = 0.05, kMost = 2.5;
  double squares = 0.0, count = 0.0;
  // What belongs to something else is no measure of what moves the rims.
  const auto size_of = [&](const TangentRow& row) {
    return std::clamp(row.residual_mm * std::sqrt(row.trust / row.variance_mm2) / noise_scale, -kMost, kMost);
  };
  for (const TangentRow& row : rows) {
    if (!row.used) continue;
    squares += size_of(row) * size_of(row), count += 1.0;
  }
  if (!(squares > 0.0)) return 1.0;
  double sum = 1.0;
  for (std::size_t lag = 1; lag < kFurthest; lag += 1 + lag / 8) {
    double products = 0.0, pairs = 0.0;
    std::size_t run = 0;  // rows of the same rim up to this one
    for (std::size_t r = 0; r < rows.size(); ++r) {
      run = rows[r].continues ? run + 1 : 0;
      if (run < lag || !rows[r].used || !rows[r - lag].used) continue;
      products += size_of(rows[r]) * size_of(rows[r - lag]), pairs += 1.0;
    }
    const double likeness = pairs > 0.0 ? products / pairs / (squares / count) : 0.0;
    if (likeness < kNone) break;
    sum += 2.0 * likeness * static_cast<double>(1 + lag / 8);
  }
  return sum;
}

}  // namespace imprint
