#include "fusion/combine/joint_start.h"

#include <algorithm>
#include <cmath>

#include "lib/geometry/median.h"

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
                    const AxisCurve& axis, const EndOutline& outline, double shift_sigma_mm,
                    const CombineConfig& config) {
  std::vector<EndPoint> points;
  const double length = axis.x_step_mm * static_cast<double>(axis.yz_mm.size() - 1);
  for (std::size_t k = 0; k < observations.size(); ++k) {
    for (const EndReading& reading : observations[k].ends) {
      const CameraShare& share = observations[k].cameras[static_cast<std::size_t>(reading.camera)];
      const Eigen::Vector3d eye = placements[k].point(share.pose.center_world_mm);
      const double x_mm = reading.last ? length : 0.0;
      const auto met = outline(axis, eye, placements[k].R * reading.ray_world, reading.last, x_mm);
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
  priors.scatter_mm = 1e-3 * observations.front().radius_mm;
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

}  // namespace

EndOutline round_ends(const AxisCurve& axis, std::span<const double> radius_mm, double end_section_mm) {
  return [first_mm = end_radius(axis, radius_mm, end_section_mm, false),
          last_mm = end_radius(axis, radius_mm, end_section_mm, true)](
             const AxisCurve& curve, const Eigen::Vector3d& eye_mm, const Eigen::Vector3d& ray, bool last,
             double x_mm) { return meet_end_circle(curve, eye_mm, ray, last ? last_mm : first_mm, last, x_mm); };
}

Result<JointStart> start_of(std::span<const ObservedForging> observations, std::span<const double> rotations_deg,
                            const ForgingSpec& forging, const CombineConfig& config) {
  if (observations.empty()) return job_failed("no observation to combine");
  if (rotations_deg.size() != observations.size())
    return invalid_input("{} observations came with {} rotations", observations.size(), rotations_deg.size());
  JointStart start;
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
    start.placements.push_back(placement);
  }
  // Ends first, so that the observations lie on each other along x.
  double length = (observations[0].end_world_mm - observations[0].start_world_mm).norm();
  start.axis = first_axis(observations[0], start.placements[0], length, config.sections);
  start.radius_mm = first_radii(observations[0], start.axis.yz_mm.size());
  const EndPlanes ends =
      find_ends(observations, start.placements, start.axis,
                round_ends(start.axis, start.radius_mm, forging.end_section_mm), config.placing_sigma_mm, config);
  for (std::size_t k = 0; k < start.placements.size(); ++k)
    start.placements[k].shift_mm.x() += ends.shift_mm[k] - ends.first.x_mm;
  length = ends.last.x_mm - ends.first.x_mm;
  if (!(length > 0.0)) return job_failed("the ends of the observations do not enclose a forging");
  start.axis = first_axis(observations[0], start.placements[0], length, config.sections);
  start.shift_sigma_mm = std::max(ends.length_sigma_mm(), 1e-3 * observations[0].radius_mm);
  return start;
}

Result<EndPlanes> final_ends(std::span<const ObservedForging> observations, std::span<const Placement> placements,
                             const AxisCurve& axis, const EndOutline& outline, std::span<const double> shift_sigma_mm,
                             const CombineConfig& config) {
  const double fixed = placements.size() > 1 ? *std::max_element(shift_sigma_mm.begin(), shift_sigma_mm.end()) : 1.0;
  EndPlanes ends = find_ends(observations, placements, axis, outline, std::max(fixed, 1e-4), config);
  if (!(ends.last.x_mm - ends.first.x_mm > 0.0))
    return job_failed("the ends of the observations do not enclose a forging");
  return ends;
}

/// How large a pixel is at the forging, across the line of sight: median over all tangents.
double mm_per_px(std::span<const ObservedForging> observations) {
  std::vector<double> scales;
  for (const ObservedForging& observed : observations)
    for (const ObservedSection& section : observed.sections)
      for (const TangentPlane& tangent : section.tangents) scales.push_back(tangent.mm_per_px);
  return median(std::move(scales));
}

Result<void> within_rig(std::span<const ObservedForging> observations, const ForgingSpec& forging,
                        CombinedForging& combined) {
  constexpr double kStretched = 1.5;  // of every observation's own length: no end was misjudged by as much
  double longest = 0;
  for (const ObservedForging& observed : observations)
    longest = std::max(longest, (observed.end_world_mm - observed.start_world_mm).norm());
  if (!(combined.length_mm <= kStretched * longest))
    return job_failed(
        "all observations together make the forging {:.0f} mm long, none of them alone more than {:.0f} mm: nothing of "
        "this can be believed; is the kind of section right (forging.section of rig.toml)?",
        combined.length_mm, longest);
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
  return {};
}

void warn_of_lengths(std::span<const ObservedForging> observations, const CombineConfig& config,
                     CombinedForging& combined) {
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const double own = (observations[k].end_world_mm - observations[k].start_world_mm).norm();
    if (std::abs(own - combined.length_mm) > config.max_length_difference_mm)
      combined.warnings.push_back(
          fmt::format("observation {}: its own length {:.1f} mm differs from {:.1f} mm of all together", k, own,
                      combined.length_mm));
  }
}

}  // namespace imprint
