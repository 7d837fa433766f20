#include "fusion/triangulate/triangulate.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "fusion/triangulate/consistency.h"
#include "fusion/triangulate/faceted_rod.h"
#include "fusion/triangulate/rod_consensus.h"
#include "fusion/triangulate/rod_ends.h"
#include "fusion/triangulate/triangulate_config.h"

namespace imprint {
namespace {

/// In tolerances of the rod all agree on: a rim point this far off is not asked again.
constexpr double kNeverShare = 2.0;

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

std::vector<ObservedSection> sections_of(const RodConsensus& rod, std::span<const CameraView> views,
                                         const EndPlanes& ends, const TriangulateConfig& config) {
  const int count = config.sections;
  const double length = ends.last.x_mm - ends.first.x_mm;
  const double step = length / (count - 1);
  std::vector<ObservedSection> sections(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    ObservedSection& section = sections[static_cast<std::size_t>(i)];
    section.s_mm = i * step;
    const double x = ends.first.x_mm + section.s_mm;
    section.axis_world_mm = rod.axis.at(x).point_mm;
    section.radius_mm = rod.median_radius_mm(x, x);
  }
  for (const RimTangent& tangent : rim_tangents(views, rod.axis)) {
    // Beyond the ends the outline follows the end circle, not the rim.
    const double s = tangent.contact.x_mm - ends.first.x_mm;
    if (s < 0.0 || s > length) continue;
    const double deviation = std::abs(rod.deviation_mm(tangent.contact));
    if (deviation > kNeverShare * rod.tolerance_mm()) continue;
    const auto nearest = static_cast<std::size_t>(std::clamp<long>(std::lround(s / step), 0, count - 1));
    sections[nearest].tangents.push_back({.normal_world = tangent.contact.normal,
                                          .offset_mm = tangent.contact.offset_mm,
                                          .sigma_mm = config.edge_sigma_px * tangent.mm_per_px,
                                          .mm_per_px = tangent.mm_per_px,
                                          .weight = tangent.weight,
                                          .camera = views[tangent.view].camera,
                                          .upper = tangent.upper,
                                          .stray = deviation > rod.tolerance_mm(),
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
  if (!(max_ray_distance_share > 0.0) || !(max_disagreement_share > 0.0) || !(min_rim_share > 0.0) ||
      !(warn_blind_share >= 0.0))
    return invalid_input("triangulate: shares above 0 expected");
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

  for (const CameraView& view : agreeing->views)
    if (view.blind_share > config.warn_blind_share)
      observed.warnings.push_back(fmt::format(
          "camera {} sees neither rim over {:.0f} % of its view in one piece; the intervals there are wider",
          ids[static_cast<std::size_t>(view.camera)], 100.0 * view.blind_share));
  RodConsensus rod = std::move(agreeing->rod);
  RodEnds ends = find_ends(agreeing->views, rod, ids, forging.end_section_mm, config.out_of_round_share);
  for (int iteration = 0; iteration < 2; ++iteration) {
    // Beyond the ends the outline follows the end circles, or something else, which must not bend the axis.
    const double length = ends.planes.last.x_mm - ends.planes.first.x_mm;
    if (!(length > rod.median_radius_mm(ends.planes.first.x_mm, ends.planes.last.x_mm)))
      return job_failed("the ends seen by the cameras lie {:.1f} mm apart, which is no rod", length);
    AxisCurve between = over(rod.axis, ends.planes.first.x_mm, ends.planes.last.x_mm);
    rod = config.faceted() ? faceted_rod(agreeing->views, std::move(between))
                           : agree_on_rod(agreeing->views, std::move(between), forging);
    ends = find_ends(agreeing->views, rod, ids, forging.end_section_mm, config.out_of_round_share);
  }
  observed.warnings.insert(observed.warnings.end(), ends.warnings.begin(), ends.warnings.end());
  observed.radius_mm = rod.median_radius_mm(ends.planes.first.x_mm, ends.planes.last.x_mm);
  observed.out_of_round_mm = rod.scatter_mm;
  observed.ends = std::move(ends.readings);
  observed.start_world_mm = rod.axis.at(ends.planes.first.x_mm).point_mm;
  observed.end_world_mm = rod.axis.at(ends.planes.last.x_mm).point_mm;
  observed.length_sigma_mm = ends.planes.length_sigma_mm();
  observed.sections = sections_of(rod, agreeing->views, ends.planes, config);
  return observed;
}

}  // namespace imprint
