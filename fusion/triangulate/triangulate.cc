#include "fusion/triangulate/triangulate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "fusion/triangulate/consistency.h"
#include "fusion/triangulate/end_planes.h"
#include "fusion/triangulate/section_fit.h"
#include "fusion/triangulate/stray_tangents.h"
#include "fusion/triangulate/triangulate_config.h"

namespace imprint {
namespace {

CameraShare share_of(const Imprint& imprint) {
  CameraShare share;
  share.id = imprint.camera_id;
  share.pose = imprint.pose;
  share.reprojection_rms_px = imprint.quality.reprojection_rms_px;
  share.targets_used = imprint.quality.targets_used;
  share.edge_points = imprint.quality.edge_points;
  return share;
}

void exclude(ObservedForging& observed, int camera, std::string reason) {
  CameraShare& share = observed.cameras[static_cast<std::size_t>(camera)];
  share.excluded = true;
  share.reason = std::move(reason);
  observed.warnings.push_back(fmt::format("camera {} left out: {}", share.id, share.reason));
}

double median_radius(std::span<const FittedCircle> circles, std::size_t first, std::size_t last) {
  std::vector<double> radii;
  for (std::size_t i = first; i < std::min(last, circles.size()); ++i)
    if (circles[i].fitted()) radii.push_back(circles[i].radius_mm);
  if (radii.empty()) return 0.0;
  std::nth_element(radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2), radii.end());
  return radii[radii.size() / 2];
}

/// `axis` sampled anew over [low, high].
AxisCurve over(const AxisCurve& axis, double low_mm, double high_mm, int samples) {
  AxisCurve stretched = axis;
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

/// `axis` over exactly the stretch on which the rims touch.
AxisCurve over_rims(const AxisCurve& axis, std::span<const RimTangent> tangents, int samples) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const RimTangent& tangent : tangents) {
    low = std::min(low, tangent.contact.x_mm);
    high = std::max(high, tangent.contact.x_mm);
  }
  return over(axis, low, high, samples);
}

struct FoundEnds {
  EndPlanes planes;
  std::vector<EndReading> readings;
};

/// Both ends from all cameras that see them, with the radius of the sections just before each.
FoundEnds find_ends(std::span<const CameraView> views, const AxisCurve& axis, std::span<const FittedCircle> circles,
                    double end_section_mm) {
  FoundEnds found;
  std::vector<EndPoint> points;
  const auto samples = circles.size();
  const auto window =
      std::clamp<std::size_t>(static_cast<std::size_t>(end_section_mm / axis.x_step_mm), 5, samples / 2);
  for (const CameraView& view : views) {
    const bool along = runs_along(view, axis);
    for (const bool last : {false, true}) {
      const EndRay& end = last == along ? view.end : view.start;
      const double radius =
          last ? median_radius(circles, samples - window, samples) : median_radius(circles, 0, window);
      Eigen::Vector3d met;
      const auto x = end_position(view, end, axis, radius, last, &met);
      if (!x) continue;
      const double range = (met - view.pose.center_world_mm).norm();
      const double along_ray = end.direction_world.dot(axis.at(*x).direction);
      const double across = std::sqrt(std::max(1e-3, 1.0 - along_ray * along_ray));
      // Seen aslant, an out-of-round rim (1 % of the radius) shifts the reading along the axis.
      const double sigma =
          std::hypot(end.sigma_px * range / view.focal_length_px / across, 0.01 * radius * along_ray / across);
      const Eigen::Vector3d beside = axis.R_line * (met - axis.at(*x).point_mm);
      points.push_back({.observation = 0, .last = last, .x_mm = *x, .beside_mm = beside.tail<2>(), .sigma_mm = sigma});
      found.readings.push_back(
          {.camera = view.camera, .last = last, .ray_world = end.direction_world, .sigma_mm = sigma});
    }
  }
  EndPriors priors;
  priors.scatter_mm = 1e-3 * median_radius(circles, 0, samples);
  found.planes = fit_end_planes(points, 1, priors);
  return found;
}

/// Where an end nobody saw is put: where the rims that reach furthest stop.
void fill_unseen_ends(EndPlanes& planes, const AxisCurve& axis, std::vector<std::string>& warnings) {
  const double x_last = axis.x_first_mm + axis.x_step_mm * static_cast<double>(axis.yz_mm.size() - 1);
  const double sigma = 5.0 * axis.x_step_mm;
  const auto fill = [&](EndPlane& plane, int row, double x_mm, const char* name) {
    if (plane.seen) return;
    plane.x_mm = x_mm;
    planes.covariance_mm2(row, row) = sigma * sigma;
    planes.covariance_mm2(0, 1) = planes.covariance_mm2(1, 0) = 0.0;
    warnings.push_back(fmt::format("no camera sees the {} end: the length reaches to where the rims stop", name));
  };
  fill(planes.first, 0, axis.x_first_mm, "first");
  fill(planes.last, 1, x_last, "last");
}

std::vector<ObservedSection> sections_of(const AxisCurve& axis, std::span<const RimTangent> tangents,
                                         std::span<const CameraView> views, const EndPlanes& ends,
                                         const TriangulateConfig& config) {
  const int count = config.sections;
  const double length = ends.last.x_mm - ends.first.x_mm;
  const double step = length / (count - 1);
  std::vector<ObservedSection> sections(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    ObservedSection& section = sections[static_cast<std::size_t>(i)];
    section.s_mm = i * step;
    section.axis_world_mm = axis.at(ends.first.x_mm + section.s_mm).point_mm;
  }
  for (const RimTangent& tangent : tangents) {
    // Beyond the ends the outline follows the end circle, not the rim.
    const double s = tangent.contact.x_mm - ends.first.x_mm;
    if (s < 0.0 || s > length) continue;
    const auto nearest = static_cast<std::size_t>(std::clamp<long>(std::lround(s / step), 0, count - 1));
    sections[nearest].tangents.push_back({.normal_world = tangent.contact.normal,
                                          .offset_mm = tangent.contact.offset_mm,
                                          .sigma_mm = config.edge_sigma_px * tangent.mm_per_px,
                                          .weight = tangent.weight,
                                          .camera = views[tangent.view].camera,
                                          .upper = tangent.upper,
                                          .s_mm = s,
                                          .ray_world = tangent.ray});
  }
  return sections;
}

}  // namespace

Result<void> TriangulateConfig::validate() const {
  if (sections < 10) return invalid_input("triangulate.sections: at least 10 expected, found {}", sections);
  if (!(edge_sigma_px > 0.0))
    return invalid_input("triangulate.edge_sigma_px: more than 0 expected, found {}", edge_sigma_px);
  if (!(min_view_angle_deg > 0.0 && min_view_angle_deg < 90.0))
    return invalid_input("triangulate.min_view_angle_deg: between 0 and 90 expected, found {}", min_view_angle_deg);
  if (!(max_ray_distance_share > 0.0) || !(max_disagreement_share > 0.0) || !(min_rim_share > 0.0))
    return invalid_input("triangulate: shares above 0 expected");
  if (axis_window < 3) return invalid_input("triangulate.axis_window: at least 3 expected, found {}", axis_window);
  return {};
}

Result<ObservedForging> triangulate(std::span<const Imprint> imprints, const ForgingSpec& forging,
                                    const TriangulateConfig& config) {
  ObservedForging observed;
  std::vector<CameraView> views;
  std::vector<std::string> ids;
  std::set<std::string> known;
  for (const Imprint& imprint : imprints) {
    observed.cameras.push_back(share_of(imprint));
    ids.push_back(imprint.camera_id);
  }
  std::string reasons;
  for (std::size_t i = 0; i < imprints.size(); ++i) {
    const int camera = static_cast<int>(i);
    auto view = view_of(imprints[i], camera, config.min_rim_share);
    if (view && !known.insert(ids[i]).second)
      view = tl::make_unexpected(std::string("a second imprint of the same camera"));
    if (view) {
      views.push_back(std::move(*view));
    } else {
      exclude(observed, camera, view.error());
      reasons += fmt::format("; {}: {}", ids[i], view.error());
    }
  }
  if (views.size() < 2)
    return job_failed("{} of {} cameras can be used, at least 2 needed{}", views.size(), imprints.size(), reasons);

  auto agreeing = agreeing_views(std::move(views), ids, forging, config);
  if (!agreeing) return job_failed("{}{}", agreeing.error().message, reasons);
  for (auto& [camera, reason] : agreeing->excluded) exclude(observed, camera, std::move(reason));
  if (agreeing->disagreement_mm > 0.0) {
    observed.disagreement_sigma_mm = agreeing->disagreement_mm;
    observed.warnings.push_back(
        fmt::format("the cameras contradict each other by {:.1f} mm and it cannot be told which one is wrong; the "
                    "intervals are widened",
                    agreeing->disagreement_mm));
  }

  AxisCurve axis = over_rims(agreeing->axis, rim_tangents(agreeing->views, agreeing->axis), config.sections);
  std::vector<FittedCircle> circles;
  for (int iteration = 0; iteration < 4; ++iteration) {
    circles = fit_circles(axis, rim_tangents(agreeing->views, axis));
    if (!(median_radius(circles, 0, circles.size()) > 0.0))
      return job_failed("no cross-section is seen by three rims: the stretches the cameras see do not overlap");
    // Beyond the ends the outline follows the end circles, which must not bend the axis: they are cut off before the
    // axis is first moved.
    const EndPlanes ends = find_ends(agreeing->views, axis, circles, forging.end_section_mm).planes;
    const double low = ends.first.seen ? ends.first.x_mm : axis.x_first_mm;
    const double high = ends.last.seen ? ends.last.x_mm : axis.x_first_mm + axis.x_step_mm * (config.sections - 1);
    if (iteration > 0) axis = moved_axis(axis, circles, config.axis_window);
    if (high - low > 10.0 * axis.x_step_mm) axis = over(axis, low, high, config.sections);
  }
  const std::vector<RimTangent> tangents = rim_tangents(agreeing->views, axis);
  circles = fit_circles(axis, tangents);
  observed.radius_mm = median_radius(circles, 0, circles.size());
  if (!(observed.radius_mm > 0.0))
    return job_failed("no cross-section is seen by three rims: the stretches the cameras see do not overlap");

  FoundEnds ends = find_ends(agreeing->views, axis, circles, forging.end_section_mm);
  fill_unseen_ends(ends.planes, axis, observed.warnings);
  const double length = ends.planes.last.x_mm - ends.planes.first.x_mm;
  if (!(length > observed.radius_mm))
    return job_failed("the ends seen by the cameras lie {:.1f} mm apart, which is no rod of {:.1f} mm diameter", length,
                      2.0 * observed.radius_mm);
  observed.ends = std::move(ends.readings);
  observed.start_world_mm = axis.at(ends.planes.first.x_mm).point_mm;
  observed.end_world_mm = axis.at(ends.planes.last.x_mm).point_mm;
  observed.length_sigma_mm = ends.planes.length_sigma_mm();
  observed.sections = sections_of(axis, tangents, agreeing->views, ends.planes, config);
  remove_stray_tangents(observed.sections, observed.radius_mm, config.stray_share);
  return observed;
}

}  // namespace imprint
