#include "fusion/triangulate/rod_ends.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "fusion/triangulate/consistency.h"

namespace imprint {
namespace {

/// One camera's reading of one end, as a place along the axis.
struct Candidate {
  EndReading reading;
  double x_mm = 0.0;
  Eigen::Vector2d beside_mm;
};

/// Where along the axis the rims stop, first and last.
struct RimStops {
  double first_mm = 0.0;
  double last_mm = 0.0;
  double sigma_mm = 0.0;
};

/// The second furthest of the rims: one alone may follow something that lies in line with the forging. A rim reaches
/// as far as most of its points lie on the rod.
RimStops rim_stops(std::span<const CameraView> views, const RodConsensus& rod) {
  constexpr std::size_t kRun = 8;  // points of which most have to agree
  std::map<std::pair<std::size_t, bool>, std::vector<RimTangent>> rims;
  for (const RimTangent& tangent : rim_tangents(views, rod.axis))
    rims[{tangent.view, tangent.upper}].push_back(tangent);
  std::vector<double> first, last;
  for (auto& [name, rim] : rims) {
    std::sort(rim.begin(), rim.end(), [](const auto& a, const auto& b) { return a.contact.x_mm < b.contact.x_mm; });
    std::vector<double> run;  // places of the last points on the rod
    std::size_t agreed = 0;
    std::vector<std::size_t> on;
    for (std::size_t i = 0; i < rim.size(); ++i)
      if (std::abs(rod.deviation_mm(rim[i].contact)) < rod.tolerance_mm()) on.push_back(i);
    std::size_t low = on.size();
    std::size_t high = 0;
    for (std::size_t k = 0; k + kRun <= on.size(); ++k) {
      if (on[k + kRun - 1] - on[k] > kRun + kRun / 2) continue;
      low = std::min(low, k);
      high = k + kRun - 1;
      ++agreed;
    }
    if (agreed == 0) continue;
    first.push_back(rim[on[low]].contact.x_mm);
    last.push_back(rim[on[high]].contact.x_mm);
  }
  const double step = rod.axis.x_step_mm;
  RimStops stops{.first_mm = rod.axis.x_first_mm,
                 .last_mm = rod.axis.x_first_mm + step * static_cast<double>(rod.axis.yz_mm.size() - 1),
                 .sigma_mm = 5.0 * step};
  if (first.size() < 2) return stops;
  std::sort(first.begin(), first.end());
  std::sort(last.rbegin(), last.rend());
  stops.first_mm = first[1];
  stops.last_mm = last[1];
  stops.sigma_mm = std::max({stops.sigma_mm, 0.5 * (first[1] - first[0]), 0.5 * (last[0] - last[1])});
  return stops;
}

std::vector<Candidate> candidates(std::span<const CameraView> views, const RodConsensus& rod, double end_section_mm,
                                  double out_of_round_share, bool last) {
  const AxisCurve& axis = rod.axis;
  const double x_end = axis.x_first_mm + axis.x_step_mm * static_cast<double>(axis.yz_mm.size() - 1);
  const double radius = last ? rod.median_radius_mm(x_end - end_section_mm, x_end)
                             : rod.median_radius_mm(axis.x_first_mm, axis.x_first_mm + end_section_mm);
  std::vector<Candidate> found;
  for (const CameraView& view : views) {
    const EndRay& end = last == runs_along(view, axis) ? view.end : view.start;
    Eigen::Vector3d met;
    const auto x = end_position(view, end, axis, radius, last, &met);
    if (!x) continue;
    const double range = (met - view.pose.center_world_mm).norm();
    const double along_ray = end.direction_world.dot(axis.at(*x).direction);
    const double across = std::sqrt(std::max(1e-3, 1.0 - along_ray * along_ray));
    // Seen aslant, an out-of-round rim shifts the reading along the axis.
    const double sigma = std::hypot(end.sigma_px * range / view.focal_length_px / across,
                                    0.5 * out_of_round_share * radius * along_ray / across);
    const Eigen::Vector3d beside = axis.R_line * (met - axis.at(*x).point_mm);
    found.push_back(
        {.reading = {.camera = view.camera, .last = last, .ray_world = end.direction_world, .sigma_mm = sigma},
         .x_mm = *x,
         .beside_mm = beside.tail<2>()});
  }
  std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) { return a.x_mm < b.x_mm; });
  return found;
}

/// The largest run of neighbours among `sorted` readings within `tolerance_mm` of each other; of equal ones the
/// nearest to `stop_mm`.
std::span<Candidate> largest_group(std::span<Candidate> sorted, double tolerance_mm, double stop_mm) {
  std::span<Candidate> best;
  double best_distance = 0.0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    std::size_t count = 1;
    while (i + count < sorted.size() && sorted[i + count].x_mm - sorted[i].x_mm < tolerance_mm) ++count;
    const double distance = std::abs(sorted[i + count / 2].x_mm - stop_mm);
    if (count < best.size() || (count == best.size() && distance >= best_distance)) continue;
    best = sorted.subspan(i, count);
    best_distance = distance;
  }
  return best;
}

}  // namespace

RodEnds find_ends(std::span<const CameraView> views, const RodConsensus& rod, std::span<const std::string> ids,
                  double end_section_mm, double out_of_round_share) {
  RodEnds ends;
  std::vector<EndPoint> points;
  const RimStops stops = rim_stops(views, rod);
  const double radius = rod.median_radius_mm(stops.first_mm, stops.last_mm);
  for (const bool last : {false, true}) {
    const char* name = last ? "last" : "first";
    const double stop = last ? stops.last_mm : stops.first_mm;
    std::vector<Candidate> all = candidates(views, rod, end_section_mm, out_of_round_share, last);
    double widest_sigma = 0.0;
    for (const Candidate& one : all) widest_sigma = std::max(widest_sigma, one.reading.sigma_mm);
    const double tolerance = std::max(0.04 * radius, 4.0 * widest_sigma);
    std::span<Candidate> group = largest_group(all, tolerance, stop);
    // Rims that run on well past a reading that no other one bears out: what was read is not the end.
    const auto past = [&](const Candidate& one) { return last ? stop - one.x_mm : one.x_mm - stop; };
    if (group.size() == 1) {
      std::erase_if(all, [&](const Candidate& one) {
        if (!(past(one) > 0.25 * radius)) return false;
        ends.warnings.push_back(
            fmt::format("camera {}: the {} end it reads lies {:.0f} mm inside where the rims stop; it "
                        "is not believed",
                        ids[static_cast<std::size_t>(one.reading.camera)], name, past(one)));
        return true;
      });
      group = largest_group(all, tolerance, stop);
    }
    double doubt = 0.0;
    for (const Candidate& one : all) {
      if (&one >= group.data() && &one < group.data() + group.size()) continue;
      const double off = one.x_mm - group[0].x_mm;
      if (group.size() == 1) doubt = std::max(doubt, std::abs(off));
      ends.warnings.push_back(
          fmt::format("camera {}: the {} end it reads lies {:+.1f} mm from {}; it is not believed{}",
                      ids[static_cast<std::size_t>(one.reading.camera)], name, off,
                      group.size() == 1 ? "that of the other" : "that of the others",
                      group.size() == 1 ? ", and the interval is widened" : ""));
    }
    for (Candidate& one : group) {
      one.reading.sigma_mm = std::hypot(one.reading.sigma_mm, doubt);
      ends.readings.push_back(one.reading);
      points.push_back({.observation = 0,
                        .last = last,
                        .x_mm = one.x_mm,
                        .beside_mm = one.beside_mm,
                        .sigma_mm = one.reading.sigma_mm});
    }
  }
  EndPriors priors;
  priors.scatter_mm = 1e-3 * radius;
  ends.planes = fit_end_planes(points, 1, priors);
  const auto fill = [&](EndPlane& plane, int row, double x_mm, const char* name) {
    if (plane.seen) return;
    plane.x_mm = x_mm;
    ends.planes.covariance_mm2(row, row) = stops.sigma_mm * stops.sigma_mm;
    ends.planes.covariance_mm2(0, 1) = ends.planes.covariance_mm2(1, 0) = 0.0;
    ends.warnings.push_back(fmt::format("no camera sees the {} end: the length reaches to where the rims stop", name));
  };
  fill(ends.planes.first, 0, stops.first_mm, "first");
  fill(ends.planes.last, 1, stops.last_mm, "last");
  return ends;
}

}  // namespace imprint
