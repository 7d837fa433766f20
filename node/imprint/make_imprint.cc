#include "node/imprint/make_imprint.h"

#include <algorithm>
#include <cmath>

#include "node/imprint/filter_config.h"
#include "node/imprint/paper_filter.h"
#include "node/imprint/robust_filter.h"

namespace imprint {
namespace {

std::vector<FilteredPoint> filtered_points(const RimCurve& curve) {
  std::vector<FilteredPoint> points;
  points.reserve(curve.size());
  for (const CurveSample& s : curve) points.push_back({s.station_px, s.offset_px, std::clamp(s.weight, 0.0, 1.0)});
  return points;
}

// Share of the whole stations between both ends at which the axis, and so both rims, is trusted.
double coverage(const RimCurve& axis, double first, double last) {
  const auto trusted = std::count_if(axis.begin(), axis.end(), [](const CurveSample& s) { return s.weight > 0; });
  return static_cast<double>(trusted) / std::max(1.0, last - first + 1);
}

}  // namespace

Result<void> FilterConfig::validate() const {
  if (rim_window < 3 || axis_window < 3 || best_rim_window < 3 || best_axis_window < 3 || step_window < 4)
    return invalid_input("filter: windows must span at least 3 stations (step_window 4), found {}, {}, {}, {} and {}",
                         rim_window, axis_window, best_rim_window, best_axis_window, step_window);
  if (max_region_gap < 1 || !(max_region_jump_px > 0) || min_region_length < 1)
    return invalid_input(
        "filter: expected max_region_gap, min_region_length >= 1 and max_region_jump_px > 0, found {}, {} and {}",
        max_region_gap, min_region_length, max_region_jump_px);
  if (!(min_coverage >= 0 && min_coverage <= 1))
    return invalid_input("filter.min_coverage: expected 0 to 1, found {}", min_coverage);
  if (!(min_step_px > 0) || !(min_disagreement_px > 0) || !(min_kink > 0))
    return invalid_input("filter: expected min_step_px, min_disagreement_px and min_kink > 0, found {}, {} and {}",
                         min_step_px, min_disagreement_px, min_kink);
  return {};
}

Result<FilteredSilhouette> filter_silhouette(const Silhouette& silhouette, EdgeMethod method,
                                             const FilterConfig& config) {
  const auto needed = static_cast<std::size_t>(config.min_points);
  if (silhouette.upper.size() < needed || silhouette.lower.size() < needed)
    return job_failed("silhouette: {} edge points on the upper and {} on the lower rim, at least {} are needed on each",
                      silhouette.upper.size(), silhouette.lower.size(), needed);
  const double first = silhouette.start.visible
                           ? silhouette.start.station_px
                           : std::min(silhouette.upper.front().station_px, silhouette.lower.front().station_px);
  const double last = silhouette.end.visible
                          ? silhouette.end.station_px
                          : std::max(silhouette.upper.back().station_px, silhouette.lower.back().station_px);
  const FilteredCurves curves =
      method == EdgeMethod::best ? robust_filter(silhouette, config) : paper_filter(silhouette, method, config);
  if (const double found = coverage(curves.axis, first, last);
      !(found >= config.min_coverage) || curves.axis.size() < 2)
    return job_failed(
        "silhouette: both rims can be trusted on {:.0f} % of the {:.0f} px between the ends, {:.0f} % are needed",
        100 * found, last - first, 100 * config.min_coverage);
  FilteredSilhouette out;
  out.frame = silhouette.frame;
  out.upper = filtered_points(curves.upper);
  out.lower = filtered_points(curves.lower);
  out.axis = filtered_points(curves.axis);
  out.start = silhouette.start;
  out.end = silhouette.end;
  return out;
}

}  // namespace imprint
