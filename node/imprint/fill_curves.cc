#include <algorithm>
#include <cmath>

#include "node/edge/silhouette_frame.h"
#include "node/imprint/make_imprint.h"
#include "node/imprint/rim_curve.h"

namespace imprint {
namespace {

struct IdealSample {
  IdealPoint p;
  double weight;
};

std::vector<IdealSample> to_ideal(const std::vector<FilteredPoint>& points, const SilhouetteFrame& frame,
                                  const CameraModel& camera) {
  std::vector<IdealSample> ideal;
  ideal.reserve(points.size());
  for (const FilteredPoint& point : points)
    ideal.push_back({undistort(camera, frame.at(point.station_px, point.offset_px)), point.weight});
  return ideal;
}

// The straight line through the trusted axis points, in the axis's direction.
StationGrid straight_grid(const std::vector<IdealSample>& axis) {
  double sum = 0, mx = 0, my = 0;
  for (const IdealSample& s : axis) sum += s.weight, mx += s.weight * s.p.x_px, my += s.weight * s.p.y_px;
  mx /= sum, my /= sum;
  double xx = 0, xy = 0, yy = 0;
  for (const IdealSample& s : axis) {
    const double x = s.p.x_px - mx, y = s.p.y_px - my;
    xx += s.weight * x * x, xy += s.weight * x * y, yy += s.weight * y * y;
  }
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
  StationGrid grid;
  grid.origin = {mx, my};
  grid.direction_x = std::cos(angle), grid.direction_y = std::sin(angle);
  const IdealPoint &a = axis.front().p, &b = axis.back().p;
  if ((b.x_px - a.x_px) * grid.direction_x + (b.y_px - a.y_px) * grid.direction_y < 0)
    grid.direction_x *= -1, grid.direction_y *= -1;
  return grid;
}

CurveSample on_grid(const StationGrid& grid, const IdealPoint& p) {
  const double x = p.x_px - grid.origin.x_px, y = p.y_px - grid.origin.y_px;
  return {x * grid.direction_x + y * grid.direction_y, y * grid.direction_x - x * grid.direction_y, 1.0};
}

RimCurve on_grid(const StationGrid& grid, const std::vector<IdealSample>& samples) {
  RimCurve curve;
  curve.reserve(samples.size());
  for (const IdealSample& s : samples) {
    CurveSample c = on_grid(grid, s.p);
    c.weight = s.weight;
    curve.push_back(c);
  }
  std::sort(curve.begin(), curve.end(),
            [](const CurveSample& a, const CurveSample& b) { return a.station_px < b.station_px; });
  return curve;
}

// Value of the trusted samples about one station: the line through those of its span that lie on the same side of a
// step as its centre, or between its two neighbours when the span holds fewer.
std::optional<CurveSample> resample(const RimCurve& curve, double station, double span) {
  constexpr double kStepPx = 1.5;
  const double half = 0.5 * std::max(span, 1.0);
  const SampleRange near = samples_near(curve, station, half);
  const CurveSample* centre = nullptr;
  for (std::size_t i = near.first; i < near.last; ++i)
    if (curve[i].weight > 0 &&
        (!centre || std::abs(curve[i].station_px - station) < std::abs(centre->station_px - station)))
      centre = &curve[i];
  if (!centre) return std::nullopt;
  RimCurve same_side;
  double all = 0;
  const auto index = static_cast<std::size_t>(centre - curve.data());
  // Outwards from the centre until the curve steps.
  for (std::size_t i = index + 1; i-- > near.first;) {
    if (i < index && std::abs(curve[i].offset_px - curve[i + 1].offset_px) > kStepPx) break;
    same_side.push_back(curve[i]);
  }
  for (std::size_t i = index + 1; i < near.last; ++i) {
    if (std::abs(curve[i].offset_px - curve[i - 1].offset_px) > kStepPx) break;
    same_side.push_back(curve[i]);
  }
  double trust = 0;
  for (const CurveSample& s : same_side) trust += s.weight;
  for (std::size_t i = near.first; i < near.last; ++i) all += 1;
  const auto fit = fit_parabola(same_side.data(), same_side.data() + same_side.size(), station, 1);
  if (!fit) return std::nullopt;
  return CurveSample{station, fit->c0,
                     std::clamp(trust / std::max(1.0, std::min(all, static_cast<double>(same_side.size()))), 0.0, 1.0)};
}

ImprintCurve fill_curve(const RimCurve& curve, const StationGrid& grid) {
  ImprintCurve out;
  out.offset_px.resize(kImprintStations);
  out.weight.assign(kImprintStations, 0.0);
  for (std::size_t i = 0; i < kImprintStations; ++i) {
    if (const auto value = resample(curve, grid.station_px(i), grid.step_px))
      out.offset_px[i] = value->offset_px, out.weight[i] = value->weight;
  }
  // Where nothing was seen: finite, on the line between the neighbours, of no weight.
  std::ptrdiff_t before = -1;
  const auto n = static_cast<std::ptrdiff_t>(kImprintStations);
  for (std::ptrdiff_t i = 0; i <= n; ++i) {
    if (i < n && !(out.weight[static_cast<std::size_t>(i)] > 0)) continue;
    for (std::ptrdiff_t k = before + 1; k < i; ++k) {
      const double left = before >= 0 ? out.offset_px[static_cast<std::size_t>(before)] : 0.0;
      const double right = i < n ? out.offset_px[static_cast<std::size_t>(i)] : left;
      const double t = before >= 0 && i < n ? static_cast<double>(k - before) / static_cast<double>(i - before) : 1.0;
      out.offset_px[static_cast<std::size_t>(k)] = (1 - t) * left + t * right;
    }
    before = i;
  }
  return out;
}

ImprintEnd map_end(const LocatedEnd& end, const SilhouetteFrame& frame, const CameraModel& camera,
                   const StationGrid& grid) {
  const CurveSample s = on_grid(grid, undistort(camera, frame.at(end.station_px, end.offset_px)));
  return {s.station_px, s.offset_px, end.sigma_px, end.visible};
}

}  // namespace

Result<void> fill_curves(const FilteredSilhouette& silhouette, const CameraModel& camera, Imprint& imprint) {
  const SilhouetteFrame frame(silhouette.frame);
  const auto axis = to_ideal(silhouette.axis, frame, camera);
  const auto trusted = std::count_if(axis.begin(), axis.end(), [](const IdealSample& s) { return s.weight > 0; });
  if (trusted < 2) return job_failed("{}: the axis has {} trusted points, at least 2 are needed", camera.id, trusted);
  StationGrid grid = straight_grid(axis);
  const RimCurve upper = on_grid(grid, to_ideal(silhouette.upper, frame, camera));
  const RimCurve lower = on_grid(grid, to_ideal(silhouette.lower, frame, camera));
  const RimCurve middle = on_grid(grid, axis);
  if (upper.empty() || lower.empty()) return job_failed("{}: one of the rims has no points", camera.id);

  imprint.start = map_end(silhouette.start, frame, camera, grid);
  imprint.end = map_end(silhouette.end, frame, camera, grid);
  const double first =
      imprint.start.visible ? imprint.start.station_px : std::min(upper.front().station_px, lower.front().station_px);
  const double last =
      imprint.end.visible ? imprint.end.station_px : std::max(upper.back().station_px, lower.back().station_px);
  if (!(last > first))
    return job_failed("{}: the forging's end ({:.1f} px) lies before its start ({:.1f} px)", camera.id, last, first);
  grid.start_px = first;
  grid.step_px = (last - first) / static_cast<double>(kImprintStations - 1);
  if (!imprint.start.visible) imprint.start = {first, 0.0, 0.0, false};
  if (!imprint.end.visible) imprint.end = {last, 0.0, 0.0, false};

  imprint.grid = grid;
  imprint.upper = fill_curve(upper, grid);
  imprint.lower = fill_curve(lower, grid);
  imprint.axis = fill_curve(middle, grid);
  return {};
}

}  // namespace imprint
