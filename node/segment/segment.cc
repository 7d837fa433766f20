#include "node/segment/segment.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "node/segment/axis_lines.h"
#include "node/segment/body_levels.h"
#include "node/segment/body_path.h"
#include "node/segment/rim_candidates.h"
#include "node/segment/segment_config.h"
#include "node/segment/working_image.h"

namespace imprint {
namespace {

// The straight line through the middles, robust against the few columns that took a wrong rim.
AxisLine fit_axis(const BodyPath& path) {
  AxisLine line;
  line.x0_px = 0.5 * (path.columns.front().x_px + path.columns.back().x_px);
  double scale = 1e9;
  for (int pass = 0; pass < 3; ++pass) {
    double sw = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const auto& c : path.columns) {
      const double x = c.x_px - line.x0_px, y = c.pair.middle_px();
      const double r = (y - line.y0_px - line.slope * x) / scale;
      const double w = c.pair.weight / (1 + r * r);
      sw += w, sx += w * x, sy += w * y, sxx += w * x * x, sxy += w * x * y;
    }
    const double det = sw * sxx - sx * sx;
    line.slope = det > 1e-9 ? (sw * sxy - sx * sy) / det : 0.0;
    line.y0_px = (sy - line.slope * sx) / sw;
    scale = 2.0;
  }
  return line;
}

// How well a body fits what is looked for, 0 to 1: seen and bright along its length, elongated, of a likely width, and
// near where the cameras of a rig are pointed.
double rate_body(const BodyPath& path, const WorkingImage& working, const SegmentPrior& prior,
                 const SegmentConfig& config) {
  if (path.empty()) return 0.0;
  const double width = path.median_width_px(), elongation = path.length_px() / std::max(1.0, width);
  const double by_length = std::min(1.0, elongation / config.full_elongation);

  const double width_px = width * working.reduction;
  const double low = prior.likely_min_px > 0 ? prior.likely_min_px : prior.diameter_min_px;
  const double high = prior.likely_max_px > 0 ? prior.likely_max_px : prior.diameter_max_px;
  const double off_range = std::max({1.0, low / width_px, width_px / high});
  const double by_width = 1.0 / (off_range * off_range);

  const cv::Size size = working.intensity.size();
  double nearest = 1e18;
  for (const auto& c : path.columns)
    nearest = std::min(nearest, std::hypot(c.x_px - 0.5 * size.width, c.pair.middle_px() - 0.5 * size.height));
  const double z = nearest / (config.center_reach * working.shorter_side_px);
  return path.mean_weight() * by_length * by_width / (1 + z * z);
}

// The level that a section must have to belong to the body: a beam that happens to go on where the forging ends is
// darker. The bright end of what was followed speaks for the body, since the beam may be longer.
float least_body_level(const BodyPath& path, const WorkingImage& working, const SegmentConfig& config) {
  std::vector<float> levels, background;
  for (const auto& c : path.columns) levels.push_back(c.pair.body);
  for (int y = 0; y < working.intensity.rows; y += 7)
    for (int x = 0; x < working.intensity.cols; x += 7)
      if (working.valid(y, x)) background.push_back(working.intensity(y, x));
  const auto quantile = [](std::vector<float>& v, double share) {
    const auto at = v.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(v.size() - 1));
    std::nth_element(v.begin(), at, v.end());
    return *at;
  };
  if (levels.empty() || background.empty()) return 0.0F;
  const float dark = quantile(background, 0.5), usual = quantile(levels, 0.8);
  return dark + static_cast<float>(config.min_body_level) * (usual - dark);
}

// The body that fits best: the lines with the most votes are followed on their full pairs; the best of these again
// about their own axis, where one rim alone will do.
BodyPath find_body(const RimPairs& pairs, const RimCandidates& rims, const WorkingImage& working,
                   const SegmentPrior& prior, double max_offset_px, const SegmentConfig& config) {
  constexpr std::size_t kFollowedTwice = 3;
  struct Rated {
    BodyPath path;
    double rating;
  };
  std::vector<Rated> bodies;
  const double separation_px = 0.3 * pairs.min_width_px;
  for (const AxisLine& line : vote_axis_lines(pairs, working.intensity.rows, separation_px, config)) {
    BodyPath path = follow_body(pairs, working, line, max_offset_px, config.max_gap_diameters);
    const double rating = rate_body(path, working, prior, config);
    if (!path.empty()) bodies.push_back({std::move(path), rating});
  }
  const auto better = [](const Rated& a, const Rated& b) { return a.rating > b.rating; };
  std::sort(bodies.begin(), bodies.end(), better);
  bodies.resize(std::min(bodies.size(), kFollowedTwice));
  for (Rated& body : bodies) {
    const AxisLine axis = fit_axis(body.path);
    const RimPairs near = pairs_about_axis(pairs, working, rims, axis, max_offset_px,
                                           least_body_level(body.path, working, config), config.max_rims_per_column);
    body.path = follow_body(near, working, axis, max_offset_px, config.max_gap_diameters);
    body.rating = rate_body(body.path, working, prior, config);
  }
  const auto best = std::min_element(bodies.begin(), bodies.end(), better);
  return best == bodies.end() ? BodyPath{} : best->path;
}

// Columns without a pair, in long gaps and towards the ends, get the rough rims.
void fill_gaps(BodyPath& path, const std::vector<RimPair>& rough, int first_x_px) {
  constexpr int kBridged = 8;  // columns over which a straight line serves
  std::vector<BodyPath::Column> filled;
  int before = first_x_px - kBridged - 1;
  const auto fill_to = [&](int next) {
    if (next - before <= kBridged) return;
    for (int x = before + 1; x < next; ++x) {
      const int k = x - first_x_px;
      if (k >= 0 && k < static_cast<int>(rough.size())) filled.push_back({x, rough[static_cast<std::size_t>(k)]});
    }
  };
  for (const auto& column : path.columns) {
    fill_to(column.x_px);
    filled.push_back(column);
    before = column.x_px;
  }
  fill_to(first_x_px + static_cast<int>(rough.size()) + kBridged);
  path.columns = std::move(filled);
}

// The body once more, now that its brightness is known: beams that pass behind it drop out, and it is followed to
// where its brightness ends rather than to where both rims are last seen.
BodyPath refine_body(const BodyPath& found, const RimPairs& pairs, const RimCandidates& rims,
                     const WorkingImage& working, double max_offset_px, const SegmentConfig& config) {
  const AxisLine line = fit_axis(found);
  const double width = found.median_width_px();
  const float least_body = least_body_level(found, working, config);
  // From a column that surely belongs to the body, as near to its middle as there is one.
  int inside = found.columns.front().x_px, nearest = working.intensity.cols;
  const int middle = found.columns[found.columns.size() / 2].x_px;
  for (const auto& c : found.columns)
    if (c.pair.both && c.pair.body >= least_body && std::abs(c.x_px - middle) < nearest)
      nearest = std::abs(c.x_px - middle), inside = c.x_px;
  const BodyLevels levels = measure_levels(working, line, width, inside, least_body, config.max_gap_diameters * width);
  const RimPairs near =
      pairs_about_axis(pairs, working, rims, line, max_offset_px, least_body, config.max_rims_per_column);
  BodyPath refined =
      follow_body(weigh_by_levels(near, working, levels), working, line, max_offset_px, 2.0 * config.max_gap_diameters);
  if (refined.length_px() < 0.5 * found.length_px()) return found;
  const std::vector<RimPair> rough = rims_by_brightness(working, line, levels, width);
  fill_gaps(refined, rough, levels.first_x_px);
  return refined;
}

struct RimSample {
  double station_px, upper_px, lower_px;
};

// Rims at whole stations between the samples; NaN across gaps longer than `max_gap_px`.
void resample_rims(const std::vector<RimSample>& samples, double max_gap_px, Segmentation& out) {
  const int first = static_cast<int>(std::ceil(samples.front().station_px));
  const int last = static_cast<int>(std::floor(samples.back().station_px));
  out.first_station_px = first;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  out.upper_offset_px.assign(static_cast<std::size_t>(std::max(0, last - first + 1)), nan);
  out.lower_offset_px = out.upper_offset_px;
  std::size_t k = 0;
  for (int s = first; s <= last; ++s) {
    while (k + 2 < samples.size() && samples[k + 1].station_px < s) ++k;
    const RimSample &a = samples[k], &b = samples[k + 1];
    const double span = b.station_px - a.station_px;
    if (span > max_gap_px) continue;
    const double t = span > 0 ? std::clamp((s - a.station_px) / span, 0.0, 1.0) : 0.0;
    out.upper_offset_px[static_cast<std::size_t>(s - first)] =
        static_cast<float>(a.upper_px + t * (b.upper_px - a.upper_px));
    out.lower_offset_px[static_cast<std::size_t>(s - first)] =
        static_cast<float>(a.lower_px + t * (b.lower_px - a.lower_px));
  }
}

Segmentation describe(const BodyPath& path, const WorkingImage& working, const SegmentConfig& config) {
  const AxisLine line = fit_axis(path);
  const ObservedPoint from = working.observed(path.columns.front().x_px, line.y_px(path.columns.front().x_px));
  const ObservedPoint to = working.observed(path.columns.back().x_px, line.y_px(path.columns.back().x_px));
  const double length = std::hypot(to.x_px - from.x_px, to.y_px - from.y_px);

  Segmentation out;
  out.direction_x = (to.x_px - from.x_px) / length;
  out.direction_y = (to.y_px - from.y_px) / length;
  // A whole pixel as origin, so that an axis along rows or columns is scanned without interpolation.
  out.origin = {std::round(0.5 * (from.x_px + to.x_px)), std::round(0.5 * (from.y_px + to.y_px))};
  const auto station = [&](ObservedPoint p) {
    return (p.x_px - out.origin.x_px) * out.direction_x + (p.y_px - out.origin.y_px) * out.direction_y;
  };
  const auto offset = [&](ObservedPoint p) {
    return (p.y_px - out.origin.y_px) * out.direction_x - (p.x_px - out.origin.x_px) * out.direction_y;
  };
  std::vector<RimSample> samples;
  samples.reserve(path.columns.size());
  for (const auto& c : path.columns) {
    const ObservedPoint u = working.observed(c.x_px, c.pair.upper_px), l = working.observed(c.x_px, c.pair.lower_px);
    samples.push_back({0.5 * (station(u) + station(l)), offset(u), offset(l)});
  }
  std::sort(samples.begin(), samples.end(),
            [](const RimSample& a, const RimSample& b) { return a.station_px < b.station_px; });
  const double width = path.median_width_px() * working.reduction;
  resample_rims(samples, std::max(8.0 * working.reduction, 2.0 * config.max_gap_diameters * width), out);
  return out;
}

}  // namespace

Result<void> SegmentConfig::validate() const {
  if (max_reduction < 1 || max_reduction > 16)
    return invalid_input("segment.max_reduction: expected 1 to 16, found {}", max_reduction);
  if (!(max_tilt_deg > 0 && max_tilt_deg <= 45))
    return invalid_input("segment.max_tilt_deg: expected above 0 to 45, found {}", max_tilt_deg);
  if (!(strong_noise_factor >= weak_noise_factor && weak_noise_factor > 0))
    return invalid_input("segment.strong_noise_factor: expected at least weak_noise_factor ({}) > 0, found {}",
                         weak_noise_factor, strong_noise_factor);
  if (!(strong_angle_deg > 0 && weak_angle_deg >= strong_angle_deg && weak_angle_deg < 90))
    return invalid_input("segment.weak_angle_deg: expected strong_angle_deg ({}) to below 90, found {}",
                         strong_angle_deg, weak_angle_deg);
  if (min_rim_run_px < 1 || max_rims_per_column < 1 || axis_candidates < 1)
    return invalid_input("segment: min_rim_run_px, max_rims_per_column and axis_candidates must be at least 1");
  if (!(min_elongation >= 0) || !(min_score >= 0 && min_score <= 1))
    return invalid_input("segment: expected min_elongation >= 0 and min_score in 0 to 1, found {} and {}",
                         min_elongation, min_score);
  return {};
}

Result<Segmentation> segment_forging(const cv::Mat& image, const SegmentPrior& prior, const SegmentConfig& config) {
  if (image.empty() || image.channels() != 1 || (image.depth() != CV_8U && image.depth() != CV_16U))
    return invalid_input("segment: expected an image of one channel with 8 or 16 bit, found {} x {}, {} channels",
                         image.cols, image.rows, image.channels());
  const double norm = std::hypot(prior.direction_x, prior.direction_y);
  if (!(std::abs(norm - 1.0) < 1e-3) || !(prior.diameter_min_px > 0) ||
      !(prior.diameter_max_px >= prior.diameter_min_px))
    return invalid_input(
        "segment: expected a unit direction and 0 < diameter_min <= diameter_max, found ({}, {}) and {} to {} px",
        prior.direction_x, prior.direction_y, prior.diameter_min_px, prior.diameter_max_px);
  if (std::min(image.cols, image.rows) < 32)
    return job_failed("no forging: the image has only {} x {} px", image.cols, image.rows);

  const WorkingImage working = make_working_image(image, prior, config);
  const double r = working.reduction;
  const RimCandidates rims = find_rim_candidates(working, config);
  const auto any = [](const auto& columns) {
    return std::any_of(columns.begin(), columns.end(), [](const auto& c) { return !c.empty(); });
  };
  if (!any(rims.upper) && !any(rims.lower)) {
    return job_failed("no forging: no edge along the axis direction stands out of the noise; is the exposure right?");
  }
  const auto pairs = pair_rims(working, rims, prior.diameter_min_px / r, prior.diameter_max_px / r);
  if (!any(pairs.columns))
    return job_failed(
        "no forging: edges were found, but no two of them {:.0f} to {:.0f} px apart with a {} body between",
        prior.diameter_min_px, prior.diameter_max_px, prior.polarity == Polarity::bright ? "bright" : "dark");

  const double max_offset = config.max_axis_bow * prior.diameter_min_px / r + 3.0;
  const BodyPath best = find_body(pairs, rims, working, prior, max_offset, config);
  if (const double width = best.median_width_px(); best.length_px() < config.min_elongation * width || best.empty())
    return job_failed(
        "no forging: the best body with both rims is {:.0f} px long and {:.0f} px wide; a length of {:.1f} widths is "
        "needed",
        best.length_px() * r, width * r, config.min_elongation);
  const BodyPath refined = refine_body(best, pairs, rims, working, max_offset, config);
  Segmentation found = describe(refined, working, config);
  const auto with_both =
      std::count_if(best.columns.begin(), best.columns.end(), [](const auto& c) { return c.pair.both; });
  found.score = std::min(1.0, static_cast<double>(with_both) / refined.length_px());
  if (found.score < config.min_score)
    return job_failed("no forging: both rims seen on {:.0f} % of the {:.0f} px long body, {:.0f} % are needed",
                      100 * found.score, refined.length_px() * r, 100 * config.min_score);
  return found;
}

}  // namespace imprint
