#include "fusion/combine/combine.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "fusion/combine/aligned_estimate.h"
#include "fusion/combine/alignment.h"
#include "fusion/combine/combine_config.h"
#include "fusion/combine/joint_estimate.h"
#include "fusion/triangulate/end_planes.h"

namespace imprint {
namespace {

/// Radius just before an end, where its circle is.
double end_radius(const AxisCurve& axis, std::span<const double> radius_mm, double end_section_mm, bool last) {
  const std::size_t n = radius_mm.size();
  const auto window =
      std::clamp<std::size_t>(static_cast<std::size_t>(0.5 * end_section_mm / axis.x_step_mm), 3, n / 2);
  std::vector<double> values(last ? radius_mm.end() - static_cast<std::ptrdiff_t>(window) : radius_mm.begin(),
                             last ? radius_mm.end() : radius_mm.begin() + static_cast<std::ptrdiff_t>(window));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(window / 2), values.end());
  return values[window / 2];
}

/// Both ends and every observation's shift along x, from all end readings.
EndPlanes find_ends(std::span<const ObservedForging> observations, std::span<const Placement> placements,
                    const AxisCurve& axis, std::span<const double> radius_mm, double shift_sigma_mm,
                    const ForgingSpec& forging, const CombineConfig& config) {
  std::vector<EndPoint> points;
  const double length = axis.x_step_mm * static_cast<double>(axis.yz_mm.size() - 1);
  const double radius_first = end_radius(axis, radius_mm, forging.end_section_mm, false);
  const double radius_last = end_radius(axis, radius_mm, forging.end_section_mm, true);
  for (std::size_t k = 0; k < observations.size(); ++k) {
    for (const EndReading& reading : observations[k].ends) {
      const CameraShare& share = observations[k].cameras[static_cast<std::size_t>(reading.camera)];
      const auto met =
          meet_end_circle(axis, placements[k].point(share.pose.center_world_mm), placements[k].R * reading.ray_world,
                          reading.last ? radius_last : radius_first, reading.last, reading.last ? length : 0.0);
      if (!met) continue;
      const Eigen::Vector3d center = axis.at(met->x()).point_mm;
      points.push_back({.observation = static_cast<int>(k),
                        .last = reading.last,
                        .x_mm = met->x(),
                        .beside_mm = (*met - center).tail<2>(),
                        .sigma_mm = reading.sigma_mm});
    }
  }
  EndPriors priors;
  priors.tilt_sigma_rad = config.end_tilt_sigma_deg * M_PI / 180.0;
  priors.shift_sigma_mm = shift_sigma_mm;
  priors.scatter_mm = 1e-3 * radius_first;
  EndPlanes planes = fit_end_planes(points, static_cast<int>(observations.size()), priors);
  // An end nobody saw lies where the first observation's rims stop.
  if (!planes.first.seen) planes.first.x_mm = 0.0;
  if (!planes.last.seen) planes.last.x_mm = length;
  const double unseen = std::pow(5.0 * axis.x_step_mm, 2);
  for (const int end : {0, 1}) {
    if (end == 0 ? planes.first.seen : planes.last.seen) continue;
    planes.covariance_mm2.row(end).setZero();
    planes.covariance_mm2.col(end).setZero();
    planes.covariance_mm2(end, end) = unseen;
  }
  return planes;
}

/// Radius along the first observation's own axis, at equal steps.
std::vector<double> first_radii(const ObservedForging& observed, std::size_t nodes) {
  std::vector<double> radii(nodes);
  const auto last = static_cast<double>(observed.sections.size() - 1);
  for (std::size_t i = 0; i < nodes; ++i) {
    const double place = last * static_cast<double>(i) / static_cast<double>(nodes - 1);
    radii[i] = observed.sections[static_cast<std::size_t>(std::lround(place))].radius_mm;
  }
  return radii;
}

/// The first observation's axis in its own frame, over [0, length].
AxisCurve first_axis(const ObservedForging& observed, const Placement& placement, double length_mm, int nodes) {
  AxisCurve source;
  source.x_first_mm = 0.0;
  const auto count = observed.sections.size();
  const double observed_length = (observed.end_world_mm - observed.start_world_mm).norm();
  source.x_step_mm = observed_length / static_cast<double>(count - 1);
  for (const ObservedSection& section : observed.sections) {
    const Eigen::Vector3d p = placement.point(section.axis_world_mm);
    source.yz_mm.emplace_back(p.y(), p.z());
  }
  source.set_slopes();
  AxisCurve axis;
  axis.x_step_mm = length_mm / (nodes - 1);
  for (int i = 0; i < nodes; ++i) axis.yz_mm.emplace_back(source.at(i * axis.x_step_mm).point_mm.tail<2>());
  axis.set_slopes();
  return axis;
}

/// Where no tangent tells the radius, such as on a shoulder that no camera sees sharply, it lies on the line between
/// the nearest sections that are known, at an end it is that of the nearest; the intervals there stay as wide as they
/// are.
void bridge_unknown_radii(JointEstimate& joint) {
  constexpr double kTimesUsual = 8.0, kLeastShare = 0.002;  // of the usual sigma; of the radius
  constexpr std::size_t kBeside = 2;
  constexpr double kOutside = 0.01;  // of the radius
  std::vector<double> sigmas;
  for (const NodeMatrix& covariance : joint.covariance) sigmas.push_back(std::sqrt(covariance(kRadius, kRadius)));
  std::vector<double> sorted = sigmas;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double usual = sorted[sorted.size() / 2];
  const auto sharp = [&](std::size_t i) {
    return sigmas[i] <= std::max(kTimesUsual * usual, kLeastShare * std::abs(joint.nodes[i](kRadius)));
  };
  // Beside a stretch nobody sees a section may hang on one tangent, and that one on something else: it has to lie
  // between its neighbours that do not.
  std::vector<char> firm(sigmas.size(), 1), known_at(sigmas.size(), 0);
  for (std::size_t i = 0; i < firm.size(); ++i)
    for (std::size_t k = i < kBeside ? 0 : i - kBeside; k <= std::min(i + kBeside, sigmas.size() - 1); ++k)
      if (!sharp(k)) firm[i] = 0;
  for (std::size_t i = 0; i < firm.size(); ++i) {
    if (!sharp(i)) continue;
    const auto next = std::find(firm.begin() + static_cast<std::ptrdiff_t>(i), firm.end(), 1);
    const auto last = std::find(firm.rend() - static_cast<std::ptrdiff_t>(i) - 1, firm.rend(), 1);
    double low = joint.nodes[i](kRadius), high = low;
    if (next != firm.end() && last != firm.rend()) {
      const double a = joint.nodes[static_cast<std::size_t>(next - firm.begin())](kRadius);
      const double b = joint.nodes[static_cast<std::size_t>(firm.rend() - last) - 1](kRadius);
      low = std::min(a, b) - kOutside * a, high = std::max(a, b) + kOutside * a;
    }
    known_at[i] = joint.nodes[i](kRadius) >= low && joint.nodes[i](kRadius) <= high;
  }
  const auto known = [&](std::size_t i) { return known_at[i] != 0; };
  std::optional<std::size_t> before;
  for (std::size_t i = 0; i < joint.nodes.size(); ++i) {
    if (!known(i)) continue;
    for (std::size_t k = before ? *before + 1 : 0; k < i; ++k) {
      const std::size_t from = before.value_or(i);  // up to the first known section: its own radius
      const double t = before ? static_cast<double>(k - from) / static_cast<double>(i - from) : 1.0;
      joint.nodes[k](kRadius) = (1.0 - t) * joint.nodes[from](kRadius) + t * joint.nodes[i](kRadius);
    }
    before = i;
  }
  for (std::size_t k = before ? *before + 1 : joint.nodes.size(); k < joint.nodes.size(); ++k)
    joint.nodes[k](kRadius) = joint.nodes[*before](kRadius);
}

/// How large a pixel is at the forging, across the line of sight: median over all tangents.
double mm_per_px(std::span<const ObservedForging> observations) {
  std::vector<double> scales;
  for (const ObservedForging& observed : observations)
    for (const ObservedSection& section : observed.sections)
      for (const TangentPlane& tangent : section.tangents) scales.push_back(tangent.mm_per_px);
  if (scales.empty()) return 0.0;
  const auto middle = scales.begin() + static_cast<std::ptrdiff_t>(scales.size() / 2);
  std::nth_element(scales.begin(), middle, scales.end());
  return *middle;
}

/// Names the stretches, longer than a shoulder is, over which no rim tells the diameter.
void warn_of_unseen(CombinedForging& combined) {
  constexpr double kUnknown = 0.025;  // sigma, of the diameter
  constexpr double kLong = 0.03;      // of the length
  const auto& sections = combined.sections;
  const auto is_unknown = [&](std::size_t i) {
    return sections[i].diameter_sigma_mm > kUnknown * sections[i].diameter_mm;
  };
  for (std::size_t from = 0; from < sections.size(); ++from) {
    std::size_t to = from;
    while (to < sections.size() && is_unknown(to)) ++to;
    if (to > from && sections[to - 1].s_mm - sections[from].s_mm > kLong * combined.length_mm)
      combined.warnings.push_back(fmt::format(
          "no camera sees the rims between {:.0f} and {:.0f} mm: the diameters there are only what lies beside them",
          sections[from].s_mm, sections[to - 1].s_mm));
    from = to;
  }
}

}  // namespace

Result<void> CombineConfig::validate() const {
  if (sections < 10) return invalid_input("combine.sections: at least 10 expected, found {}", sections);
  if (iterations < 2) return invalid_input("combine.iterations: at least 2 expected, found {}", iterations);
  if (!(rotation_tolerance_deg > 0.0) || !(placing_sigma_mm > 0.0) || !(end_tilt_sigma_deg > 0.0))
    return invalid_input("combine: rotation_tolerance_deg, placing_sigma_mm and end_tilt_sigma_deg above 0 expected");
  if (!(interval_widening >= 1.0))
    return invalid_input("combine.interval_widening: at least 1 expected, found {}", interval_widening);
  if (!(out_of_round_share > 0.0) || !(out_of_round_length_share > 0.0))
    return invalid_input("combine: out_of_round_share and out_of_round_length_share above 0 expected");
  return {};
}

Result<CombinedForging> combine(std::span<const ObservedForging> observations, std::span<const double> rotations_deg,
                                const ForgingSpec& forging, const CombineConfig& config) {
  if (observations.empty()) return job_failed("no observation to combine");
  if (rotations_deg.size() != observations.size())
    return invalid_input("{} observations came with {} rotations", observations.size(), rotations_deg.size());
  CombinedForging combined;
  std::vector<Placement> placements;
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const ObservedForging& observed = observations[k];
    if (observed.sections.size() < 2 || !(observed.end_world_mm - observed.start_world_mm).allFinite() ||
        !((observed.end_world_mm - observed.start_world_mm).norm() > 0.0))
      return job_failed("observation {} has no length to align", k);
    if (!std::isfinite(rotations_deg[k])) return invalid_input("observation {}: its rotation is not a number", k);
    Placement placement = pre_align(observed, forging.end_section_mm);
    const Eigen::Matrix3d back = turn_about_x(-(rotations_deg[k] - rotations_deg[0]) * M_PI / 180.0);
    placement.R = back * placement.R;
    placement.shift_mm = back * placement.shift_mm;
    placements.push_back(placement);
  }

  // Ends first, so that the observations lie on each other along x, then all tangents together.
  const int nodes = config.sections;
  double length = (observations[0].end_world_mm - observations[0].start_world_mm).norm();
  AxisCurve axis = first_axis(observations[0], placements[0], length, nodes);
  std::vector<double> radii = first_radii(observations[0], axis.yz_mm.size());
  EndPlanes ends = find_ends(observations, placements, axis, radii, config.placing_sigma_mm, forging, config);
  for (std::size_t k = 0; k < placements.size(); ++k) placements[k].shift_mm.x() += ends.shift_mm[k] - ends.first.x_mm;
  length = ends.last.x_mm - ends.first.x_mm;
  if (!(length > 0.0)) return job_failed("the ends of the observations do not enclose a forging");
  axis = first_axis(observations[0], placements[0], length, nodes);

  const double shift_sigma = std::max(ends.length_sigma_mm(), 1e-3 * observations[0].radius_mm);
  auto joint = estimate_jointly(observations, placements, axis, radii, shift_sigma, config);
  if (!joint) return job_failed("the tangents of the observations do not determine a forging");
  bridge_unknown_radii(*joint);

  radii.clear();
  for (const NodeVector& node : joint->nodes) radii.push_back(node(kRadius));
  const double fixed =
      placements.size() > 1 ? *std::max_element(joint->shift_sigma_mm.begin(), joint->shift_sigma_mm.end()) : 1.0;
  ends = find_ends(observations, joint->placements, joint->axis(), radii, std::max(fixed, 1e-4), forging, config);
  if (!(ends.last.x_mm - ends.first.x_mm > 0.0))
    return job_failed("the ends of the observations do not enclose a forging");
  align(*joint, ends, forging.end_section_mm, config.sections, combined);
  combined.length_sigma_mm = ends.length_sigma_mm();
  // No number of tangents takes away what moves all rims outwards or inwards alike.
  const double common = 2.0 * config.common_edge_sigma_px * mm_per_px(observations);
  for (CombinedSection& section : combined.sections) {
    section.diameter_sigma_mm = std::hypot(section.diameter_sigma_mm, common);
    section.axis_covariance_mm2 *= config.interval_widening * config.interval_widening;
    section.diameter_sigma_mm *= config.interval_widening;
    section.circularity_sigma_mm *= config.interval_widening;
  }
  widen_draws(combined, config.interval_widening, 0.5 * common);
  const auto beyond = std::count_if(combined.sections.begin(), combined.sections.end(), [&](const auto& section) {
    return section.diameter_mm < 0.9 * forging.diameter_min_mm || section.diameter_mm > 1.1 * forging.diameter_max_mm;
  });
  if (2 * beyond > static_cast<long>(combined.sections.size()))
    return job_failed(
        "{} of {} sections lie outside the rig's diameters of {:.0f} to {:.0f} mm: nothing of this can be believed",
        beyond, combined.sections.size(), forging.diameter_min_mm, forging.diameter_max_mm);
  if (beyond > 0)
    combined.warnings.push_back(fmt::format("{} sections lie outside the rig's diameters of {:.0f} to {:.0f} mm",
                                            beyond, forging.diameter_min_mm, forging.diameter_max_mm));
  warn_of_unseen(combined);
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const double own = (observations[k].end_world_mm - observations[k].start_world_mm).norm();
    if (std::abs(own - combined.length_mm) > config.max_length_difference_mm)
      combined.warnings.push_back(
          fmt::format("observation {}: its own length {:.1f} mm differs from {:.1f} mm of all together", k, own,
                      combined.length_mm));
  }
  return combined;
}

}  // namespace imprint
