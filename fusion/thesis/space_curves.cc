#include "fusion/thesis/space_curves.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "fusion/thesis/savitzky_golay.h"
#include "fusion/triangulate/first_axis.h"

namespace imprint {
namespace {

/// A curve's direction at a place that may fall between two stations; nothing where it is not trusted.
std::optional<Eigen::Vector3d> direction_at(const std::vector<CurveRay>& curve, double station) {
  const auto before = static_cast<std::size_t>(std::clamp(station, 0.0, static_cast<double>(curve.size() - 1)));
  const std::size_t after = std::min(before + 1, curve.size() - 1);
  const double u = station - static_cast<double>(before);
  if (curve[before].weight <= 0.0) return std::nullopt;
  if (u < 1e-9) return curve[before].direction_world;
  if (curve[after].weight <= 0.0) return std::nullopt;
  return ((1.0 - u) * curve[before].direction_world + u * curve[after].direction_world).normalized();
}

/// [D] equation 4: the edge point at the image scale of the axis point. The scale is the distance of the axis point
/// over the length of its own image vector [x, y, f], of which f, as printed, is the case of the image's middle.
std::optional<Eigen::Vector3d> transfer(const CameraView& view, const Eigen::Vector3d& axis_mm,
                                        const Eigen::Vector3d& edge_direction) {
  const Eigen::Vector3d forward = view.pose.R_cam_world.row(2);
  const Eigen::Vector3d to_axis = axis_mm - view.pose.center_world_mm;
  const double depth = to_axis.dot(forward);
  const double along = edge_direction.dot(forward);
  if (!(depth > 0.0) || !(along > 1e-3)) return std::nullopt;
  return view.pose.center_world_mm + edge_direction * (depth / along);
}

/// `points`, ascending along `direction`, at equal steps of it.
std::vector<Eigen::Vector3d> at_equal_steps(const std::vector<Eigen::Vector3d>& points,
                                            const Eigen::Vector3d& direction, int count) {
  const double first = direction.dot(points.front());
  const double last = direction.dot(points.back());
  std::vector<Eigen::Vector3d> even;
  std::size_t k = 0;
  for (int i = 0; i < count; ++i) {
    const double x = first + (last - first) * i / (count - 1);
    while (k + 2 < points.size() && direction.dot(points[k + 1]) < x) ++k;
    const double a = direction.dot(points[k]);
    const double u = (x - a) / (direction.dot(points[k + 1]) - a);
    even.emplace_back((1.0 - u) * points[k] + u * points[k + 1]);
  }
  return even;
}

/// One rim of one camera, a place a group; empty where the camera is not in the group or does not trust its rim.
struct Rim {
  std::size_t view;
  bool upper;
  std::vector<std::optional<Eigen::Vector3d>> points_mm;
};

std::vector<Rim> rims_beside(const std::vector<AxisGroup>& groups, std::span<const CameraView> views) {
  std::vector<Rim> rims;
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (const bool upper : {true, false}) {
      Rim rim{v, upper, std::vector<std::optional<Eigen::Vector3d>>(groups.size())};
      for (std::size_t i = 0; i < groups.size(); ++i) {
        const auto member = std::ranges::find(groups[i].members, v, &AxisGroup::Member::view);
        if (member == groups[i].members.end()) continue;
        const auto edge = direction_at(upper ? views[v].upper : views[v].lower, member->station);
        if (edge) rim.points_mm[i] = transfer(views[v], groups[i].point_mm, *edge);
      }
      rims.push_back(std::move(rim));
    }
  }
  return rims;
}

/// Whether half of the rims run steeper than 45 degrees to the axis from group i to the next: [D]'s segmentation keeps
/// level edges only, and so the forging begins where the outline of its end face has become one.
bool is_steep(const std::vector<AxisGroup>& groups, const std::vector<Rim>& rims, std::size_t i) {
  const double along = (groups[i + 1].point_mm - groups[i].point_mm).norm();
  int seen = 0, steep = 0;
  for (const Rim& rim : rims) {
    const auto &a = rim.points_mm[i], &b = rim.points_mm[i + 1];
    if (!a || !b) continue;
    ++seen;
    if (std::abs((*b - groups[i + 1].point_mm).norm() - (*a - groups[i].point_mm).norm()) > along) ++steep;
  }
  return 2 * steep >= std::max(seen, 1);
}

/// The groups between the end faces: from the first to one past the last.
std::pair<std::size_t, std::size_t> between_end_faces(const std::vector<AxisGroup>& groups,
                                                      const std::vector<Rim>& rims) {
  constexpr std::size_t kLevel = 3;  // groups in a row that make an edge
  const std::size_t most = groups.size() / 20;
  const auto faces = [&](const auto& at) {
    std::size_t from = 0, level = 0;
    for (std::size_t i = 0; i < most + kLevel && level < kLevel; ++i) {
      level = is_steep(groups, rims, at(i)) ? 0 : level + 1;
      if (level == 0) from = std::min(i + 1, most);
    }
    return from;
  };
  const std::size_t pairs = groups.size() - 1;
  return {faces([](std::size_t i) { return i; }), groups.size() - faces([&](std::size_t i) { return pairs - 1 - i; })};
}

}  // namespace

Result<void> ThesisConfig::validate() const {
  if (sections < 10) return invalid_input("thesis.sections: at least 10 expected, found {}", sections);
  if (axis_window < 3 || silhouette_window < 3)
    return invalid_input("thesis: windows of at least 3 sections expected, found {} and {}", axis_window,
                         silhouette_window);
  if (!(max_ray_distance_share > 0.0)) return invalid_input("thesis.max_ray_distance_share: above 0 expected");
  return {};
}

double SpaceCurves::step_mm() const {
  return (axis_mm.back() - axis_mm.front()).norm() / static_cast<double>(axis_mm.size() - 1);
}

void SpaceCurves::move(const Placement& placement) {
  for (Eigen::Vector3d& point : axis_mm) point = placement.point(point);
  for (Silhouette& silhouette : silhouettes) {
    silhouette.center_mm = placement.point(silhouette.center_mm);
    for (Eigen::Vector3d& point : silhouette.points_mm) point = placement.point(point);
  }
}

Result<SpaceCurves> space_curves(std::span<const CameraView> views, const ForgingSpec& forging,
                                 const ThesisConfig& config) {
  auto groups = group_axis_rays(views, config.max_ray_distance_share * forging.diameter_max_mm);
  std::vector<Eigen::Vector3d> axis;
  for (const AxisGroup& group : groups) axis.push_back(group.point_mm);
  const auto line = line_through(axis, forging.axis_direction_world, config.sections);
  if (!line) return pass_on(line.error());
  const Eigen::Vector3d direction = line->R_line.row(0);
  const auto place = [&](const AxisGroup& group) { return direction.dot(group.point_mm); };
  std::ranges::sort(groups, {}, place);
  groups.erase(std::unique(groups.begin(), groups.end(),
                           [&](const AxisGroup& a, const AxisGroup& b) { return place(b) - place(a) < 1e-9; }),
               groups.end());
  if (groups.size() < 10) return job_failed("the axis imprints meet in {} points, at least 10 needed", groups.size());

  const std::vector<Rim> rims = rims_beside(groups, views);
  const auto [from, to] = between_end_faces(groups, rims);
  axis.clear();
  for (std::size_t i = from; i < to; ++i) axis.push_back(groups[i].point_mm);
  SpaceCurves curves;
  curves.axis_mm = savitzky_golay(at_equal_steps(axis, direction, config.sections), config.axis_window);
  for (const Rim& rim : rims) {
    Silhouette silhouette{
        .view = rim.view, .upper = rim.upper, .center_mm = views[rim.view].pose.center_world_mm, .points_mm = {}};
    for (std::size_t i = from; i < to; ++i)
      if (rim.points_mm[i]) silhouette.points_mm.push_back(*rim.points_mm[i]);
    std::ranges::sort(silhouette.points_mm, {}, [&](const Eigen::Vector3d& p) { return direction.dot(p); });
    silhouette.points_mm = savitzky_golay(silhouette.points_mm, config.silhouette_window);
    if (silhouette.points_mm.size() > 1) curves.silhouettes.push_back(std::move(silhouette));
  }
  return curves;
}

}  // namespace imprint
