#include "node/edge/locate_edges.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "lib/geometry/median.h"
#include "node/edge/body_brightness.h"
#include "node/edge/edge_config.h"
#include "node/edge/forging_ends.h"
#include "node/edge/rim_edges.h"
#include "node/edge/rim_haze.h"
#include "node/edge/silhouette_frame.h"

namespace imprint {
namespace {

constexpr std::array<std::pair<std::string_view, EdgeMethod>, 7> kMethods{{{"best", EdgeMethod::best},
                                                                           {"orientation", EdgeMethod::orientation},
                                                                           {"magnitude", EdgeMethod::magnitude},
                                                                           {"combined", EdgeMethod::combined},
                                                                           {"uniform", EdgeMethod::uniform},
                                                                           {"none", EdgeMethod::none},
                                                                           {"pixel", EdgeMethod::pixel}}};

// Middle and width over the outermost stations that the segmentation saw.
EndSearch describe_end(const Segmentation& s, bool at_start) {
  EndSearch search;
  search.at_start = at_start;
  const std::size_t n = s.upper_offset_px.size();
  std::vector<double> widths, middles;
  for (std::size_t k = 0; k < n; ++k) {  // some station has both rims: the caller made sure
    const std::size_t i = at_start ? k : n - 1 - k;
    const double upper = s.upper_offset_px[i], lower = s.lower_offset_px[i];
    if (std::isnan(upper) || std::isnan(lower)) continue;
    widths.push_back(lower - upper);
    middles.push_back(0.5 * (upper + lower));
    if (static_cast<double>(widths.size()) > 0.3 * widths.front()) break;
  }
  search.diameter_px = median(std::move(widths));
  search.axis_offset_px = median(std::move(middles));
  search.station_px = at_start ? s.first_station_px : s.first_station_px + static_cast<double>(n) - 1;
  return search;
}

// The segmentation's rim with gaps closed linearly, carried on to the stations given.
ExpectedRim expected_rim(const Segmentation& s, RimSide side, int first, int last) {
  const auto& from = side == RimSide::upper ? s.upper_offset_px : s.lower_offset_px;
  ExpectedRim rim{side, first, {}, {}};
  std::ptrdiff_t before = -1;
  std::vector<double> closed(from.begin(), from.end());
  for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(closed.size()); ++i) {
    if (std::isnan(closed[static_cast<std::size_t>(i)])) continue;
    for (std::ptrdiff_t k = before + 1; before >= 0 && k < i; ++k) {
      const double t = static_cast<double>(k - before) / static_cast<double>(i - before);
      closed[static_cast<std::size_t>(k)] =
          (1 - t) * closed[static_cast<std::size_t>(before)] + t * closed[static_cast<std::size_t>(i)];
    }
    before = i;
  }
  for (int station = first; station <= last; ++station) {
    const auto i =
        std::clamp<std::ptrdiff_t>(station - s.first_station_px, 0, static_cast<std::ptrdiff_t>(closed.size()) - 1);
    rim.offset_px.push_back(closed[static_cast<std::size_t>(i)]);
  }
  return rim;
}

double saturated_fraction(const cv::Mat& image, const SilhouetteFrame& frame, const ExpectedRim& upper,
                          const ExpectedRim& lower) {
  const double full_scale = image.depth() == CV_16U ? 65535.0 : 255.0;
  std::size_t saturated = 0, count = 0;
  for (std::size_t i = 0; i < upper.offset_px.size(); i += 8) {
    const double station = upper.first_station_px + static_cast<double>(i);
    for (double offset = upper.offset_px[i] + 2; offset < lower.offset_px[i] - 2; offset += 4) {
      const ObservedPoint p = frame.at(station, offset);
      const int x = static_cast<int>(std::lround(p.x_px)), y = static_cast<int>(std::lround(p.y_px));
      if (x < 0 || y < 0 || x >= image.cols || y >= image.rows) continue;
      const double value = image.depth() == CV_16U ? image.at<unsigned short>(y, x) : image.at<unsigned char>(y, x);
      saturated += value >= full_scale;
      ++count;
    }
  }
  return count > 0 ? static_cast<double>(saturated) / static_cast<double>(count) : 0.0;
}

}  // namespace

Result<void> EdgeConfig::validate() const {
  if (!(search_outward_px >= 2 && search_inward_px >= 2))
    return invalid_input("edge.search_outward_px, edge.search_inward_px: expected at least 2, found {} and {}",
                         search_outward_px, search_inward_px);
  if (!(scan_spacing_px > 0 && scan_spacing_px <= 1))
    return invalid_input("edge.scan_spacing_px: expected above 0 to 1, found {}", scan_spacing_px);
  if (!(smoothing_sigma_px > 0))
    return invalid_input("edge.smoothing_sigma_px: expected above 0, found {}", smoothing_sigma_px);
  if (max_candidates < 1 || smoothing_stations < 1 || max_gap_stations < 4)
    return invalid_input(
        "edge: expected max_candidates, smoothing_stations >= 1 and max_gap_stations >= 4, found {}, {} and {}",
        max_candidates, smoothing_stations, max_gap_stations);
  if (!(end_half_band > 0 && end_half_band < 0.5))
    return invalid_input("edge.end_half_band: expected above 0 to below 0.5, found {}", end_half_band);
  return {};
}

Silhouette locate_edges(const cv::Mat& image, const Segmentation& segmentation, Polarity polarity, EdgeMethod method,
                        const EdgeConfig& config) {
  Silhouette silhouette;
  silhouette.frame = segmentation;
  const bool any = std::any_of(segmentation.upper_offset_px.begin(), segmentation.upper_offset_px.end(),
                               [](float v) { return !std::isnan(v); });
  if (!any || image.empty()) return silhouette;
  const SilhouetteFrame frame(segmentation);

  EndSearch start = describe_end(segmentation, true), end = describe_end(segmentation, false);
  double first = start.station_px, last = end.station_px;
  constexpr double kBeyondPx = 4.0;  // the walk is true to a px or two
  if (const auto found = walk_to_end(image, frame, start, polarity)) {
    start.station_px = *found;
    silhouette.start = locate_end(image, frame, start, polarity, config);
    first = std::min(first, *found);
  }
  if (const auto found = walk_to_end(image, frame, end, polarity)) {
    end.station_px = *found;
    silhouette.end = locate_end(image, frame, end, polarity, config);
    last = std::max(last, *found);
  }
  if (silhouette.start.visible) first = silhouette.start.station_px - kBeyondPx;
  if (silhouette.end.visible) last = silhouette.end.station_px + kBeyondPx;

  const int from = static_cast<int>(std::floor(first)), to = static_cast<int>(std::ceil(last));
  ExpectedRim upper = expected_rim(segmentation, RimSide::upper, from, to);
  ExpectedRim lower = expected_rim(segmentation, RimSide::lower, from, to);
  upper.body = body_brightness(image, frame, from, upper.offset_px, lower.offset_px, polarity);
  lower.body = upper.body;
  RimEdges upper_edges = find_rim_edges(image, frame, upper, polarity, method, config);
  RimEdges lower_edges = find_rim_edges(image, frame, lower, polarity, method, config);
  std::vector<double> steps(upper_edges.step.begin(), upper_edges.step.end());
  steps.insert(steps.end(), lower_edges.step.begin(), lower_edges.step.end());
  silhouette.contrast = median(std::move(steps));
  silhouette.upper = std::move(upper_edges.points);
  silhouette.lower = std::move(lower_edges.points);
  silhouette.saturated_fraction = saturated_fraction(image, frame, upper, lower);
  // Hot air shifts an end as a whole too, which no residual about its face shows, but the rims do.
  const double shifted = config.end_haze_share * rim_haze_px(silhouette);
  for (LocatedEnd* located : {&silhouette.start, &silhouette.end})
    if (located->visible) located->sigma_px = std::hypot(located->sigma_px, shifted);
  return silhouette;
}

Result<EdgeMethod> edge_method_from_name(std::string_view name) {
  for (const auto& [known, method] : kMethods)
    if (known == name) return method;
  return invalid_input("method: expected best, orientation, magnitude, combined, uniform, none or pixel, found '{}'",
                       name);
}

std::string_view edge_method_name(EdgeMethod method) {
  for (const auto& [name, known] : kMethods)
    if (known == method) return name;
  return "best";
}

}  // namespace imprint
