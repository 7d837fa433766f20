#include "fusion/thesis/thesis_geometry.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace imprint {
namespace {

/// The point of a curve (ascending x) at x; nothing beyond its ends or across a gap wider than `widest_mm`.
std::optional<Eigen::Vector3d> at(const std::vector<Eigen::Vector3d>& curve, double x_mm, double widest_mm) {
  const auto after = std::ranges::lower_bound(curve, x_mm, {}, [](const Eigen::Vector3d& p) { return p.x(); });
  if (after == curve.begin() || after == curve.end()) return std::nullopt;
  const Eigen::Vector3d &a = *(after - 1), &b = *after;
  if (b.x() - a.x() > widest_mm) return std::nullopt;
  const double u = (x_mm - a.x()) / (b.x() - a.x());
  return (1.0 - u) * a + u * b;
}

/// To the frame whose x is the ideal axis, from the first axis point.
Placement aligning(const std::vector<Eigen::Vector3d>& axis, double end_section_mm) {
  ObservedForging observed;
  observed.start_world_mm = axis.front();
  observed.end_world_mm = axis.back();
  for (const Eigen::Vector3d& point : axis) observed.sections.push_back({.axis_world_mm = point, .tangents = {}});
  return pre_align(observed, end_section_mm);
}

/// [D] equation 5: the shift in y and z that lays the secondary axis on the primary one, compared at the same x.
Placement best_shift(const std::vector<Eigen::Vector3d>& primary, const std::vector<Eigen::Vector3d>& secondary) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (const Eigen::Vector3d& point : primary) {
    const auto other = at(secondary, point.x(), 1e9);
    if (!other) continue;
    sum += point - *other;
    count += 1.0;
  }
  Placement shift;
  if (count > 0.0) shift.shift_mm = {0.0, sum.y() / count, sum.z() / count};
  return shift;
}

/// [D] equation 6, at the primary's places.
std::vector<Eigen::Vector3d> joint_axis(const std::vector<SpaceCurves>& observations) {
  std::vector<Eigen::Vector3d> mean;
  for (const Eigen::Vector3d& point : observations.front().axis_mm) {
    Eigen::Vector3d sum = point;
    double count = 1.0;
    for (std::size_t k = 1; k < observations.size(); ++k) {
      const auto other = at(observations[k].axis_mm, point.x(), 1e9);
      if (!other) continue;
      sum += *other;
      count += 1.0;
    }
    mean.emplace_back(sum / count);
  }
  return mean;
}

double scatter(const std::vector<double>& values, double mean) {
  if (values.size() < 2) return 0.0;
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

/// Everything about one section but its place.
void measure_section(const std::vector<SpaceCurves>& observations, double widest_mm, CombinedSection& section) {
  std::vector<double> radii;
  std::map<std::pair<std::size_t, std::size_t>, std::vector<double>> of_camera;  // by observation and view
  for (std::size_t k = 0; k < observations.size(); ++k) {
    for (const Silhouette& silhouette : observations[k].silhouettes) {
      const auto point = at(silhouette.points_mm, section.axis_mm.x(), widest_mm);
      if (!point) continue;
      const double distance = (silhouette.center_mm - section.axis_mm).norm();
      const double radius = (*point - section.axis_mm).norm();
      const double corrected = distance * std::sin(std::atan(radius / distance));  // [C] equation 4
      radii.push_back(corrected);
      of_camera[{k, silhouette.view}].push_back(corrected);
    }
  }
  if (radii.empty()) return;
  const auto n = static_cast<double>(radii.size());
  double mean = 0.0;
  for (const double radius : radii) mean += radius / n;
  const double sigma = scatter(radii, mean);
  section.diameter_mm = 2.0 * mean;
  section.diameter_sigma_mm = 2.0 * sigma / std::sqrt(n);
  section.axis_covariance_mm2 = Eigen::Matrix2d::Identity() * 2.0 * sigma * sigma / n;
  double narrowest = 0.0, widest = 0.0;
  bool any = false;
  for (const auto& [camera, both] : of_camera) {
    if (both.size() != 2) continue;
    const double width = both[0] + both[1];
    narrowest = any ? std::min(narrowest, width) : width;
    widest = any ? std::max(widest, width) : width;
    any = true;
  }
  section.circularity_mm = 0.5 * (widest - narrowest);
  section.circularity_sigma_mm = sigma;
}

}  // namespace

Result<CombinedForging> thesis_geometry(std::span<const SpaceCurves> observations,
                                        std::span<const double> rotations_deg, const ForgingSpec& forging,
                                        const ThesisConfig& config) {
  if (observations.empty()) return job_failed("no observation to combine");
  if (rotations_deg.size() != observations.size())
    return invalid_input("{} observations came with {} rotations", observations.size(), rotations_deg.size());
  std::vector<SpaceCurves> laid(observations.begin(), observations.end());
  Placement from_world;
  for (std::size_t k = 0; k < laid.size(); ++k) {
    const Placement own = aligning(laid[k].axis_mm, forging.end_section_mm);
    const Eigen::Matrix3d back = turn_about_x(-(rotations_deg[k] - rotations_deg[0]) * M_PI / 180.0);
    laid[k].move({.R = back * own.R, .shift_mm = back * own.shift_mm});
    if (k == 0) from_world = own;
    if (k > 0) laid[k].move(best_shift(laid[0].axis_mm, laid[k].axis_mm));
  }
  std::vector<Eigen::Vector3d> axis = joint_axis(laid);
  const Placement final = aligning(axis, forging.end_section_mm);
  // The joint axis lies in the primary's frame already: only the small turn about y and z is taken over.
  for (SpaceCurves& curves : laid) curves.move(final);
  for (Eigen::Vector3d& point : axis) point = final.point(point);

  CombinedForging combined;
  combined.R_forging_world = final.R * from_world.R;
  combined.origin_world_mm = from_world.R.transpose() * (-final.R.transpose() * final.shift_mm - from_world.shift_mm);
  for (std::size_t i = 1; i < axis.size(); ++i) combined.length_mm += (axis[i] - axis[i - 1]).norm();
  combined.length_sigma_mm = laid.front().step_mm() / std::sqrt(static_cast<double>(laid.size()));
  const double span = axis.back().x() - axis.front().x();
  for (int s = 0; s < config.sections; ++s) {
    CombinedSection section;
    const double x = axis.front().x() + span * s / (config.sections - 1);
    const bool inside = s > 0 && s + 1 < config.sections;
    section.axis_mm = inside ? at(axis, x, 1e9).value_or(axis.back()) : s == 0 ? axis.front() : axis.back();
    section.s_mm = section.axis_mm.x() - axis.front().x();
    measure_section(laid, 5.0 * laid.front().step_mm(), section);
    combined.sections.push_back(section);
  }
  // At the very ends and where no rim is trusted there is no radius: the nearest section has one.
  const auto known = [](const CombinedSection& section) { return section.diameter_mm > 0.0; };
  if (std::ranges::none_of(combined.sections, known)) return job_failed("no silhouette stands beside the axis");
  const std::vector<CombinedSection> as_seen = combined.sections;
  for (std::size_t i = 0; i < as_seen.size(); ++i) {
    if (known(as_seen[i])) continue;
    std::size_t away = 1;
    while (!(i >= away && known(as_seen[i - away])) && !(i + away < as_seen.size() && known(as_seen[i + away]))) ++away;
    const CombinedSection& near = i >= away && known(as_seen[i - away]) ? as_seen[i - away] : as_seen[i + away];
    const auto [place, point] = std::pair(combined.sections[i].s_mm, combined.sections[i].axis_mm);
    combined.sections[i] = near;
    combined.sections[i].s_mm = place;
    combined.sections[i].axis_mm = point;
  }
  return combined;
}

}  // namespace imprint
