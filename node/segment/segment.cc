#include "node/segment/segment.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "node/segment/axis_lines.h"
#include "node/segment/body_search.h"
#include "node/segment/directions.h"
#include "node/segment/other_bodies.h"
#include "node/segment/rim_candidates.h"
#include "node/segment/segment_config.h"
#include "node/segment/working_image.h"

namespace imprint {
namespace {

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

// A body and the image it was seen in.
struct Sight {
  FoundBody body;
  WorkingImage working;
};

void look_closely(const WorkingImage& working, const SegmentPrior& prior, const SegmentConfig& config,
                  std::vector<Sight>& sights) {
  const double r = working.reduction;
  const RimCandidates rims = find_rim_candidates(working, config);
  const RimPairs pairs = pair_rims(working, rims, prior.diameter_min_px / r, prior.diameter_max_px / r);
  for (FoundBody& body : find_bodies(pairs, rims, working, prior, config)) sights.push_back({std::move(body), working});
}

Segmentation describe(const BodyPath& path, const AxisLine& axis, const WorkingImage& working,
                      const SegmentConfig& config) {
  const AxisLine line = fit_axis(path, axis);
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

// Whether the best body will do for a forging; if not, what is missing.
Result<void> check_body(const FoundBody& body, const WorkingImage& working, const SegmentConfig& config) {
  const double r = working.reduction, width = body.whole.median_width_px();
  const auto middle =
      body.whole.empty()
          ? ObservedPoint{}
          : working.observed(0.5 * (body.whole.columns.front().x_px + body.whole.columns.back().x_px), body.axis.y0_px);
  if (body.whole.empty() || body.whole.length_px() < config.min_elongation * width)
    return job_failed(
        "no forging: the best body is {:.0f} px long and {:.0f} px wide; a length of {:.1f} widths is needed",
        body.whole.length_px() * r, width * r, config.min_elongation);
  if (body.score < config.min_score)
    return job_failed(
        "no forging: the best body, at ({:.0f}, {:.0f}) px and {:.0f} x {:.0f} px large, is none with a score of "
        "{:.2f} ({:.2f} is needed): both rims seen on {:.0f} % of its length, {:.0f} % of its inside of one "
        "brightness, "
        "contrast {:.0f} of 255",
        middle.x_px, middle.y_px, body.whole.length_px() * r, width * r, body.score, config.min_score,
        100 * body.proof.both, 100 * body.proof.filled, 255 * body.proof.contrast);
  return {};
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

  const ReducedImage reduced = reduce_image(image, prior, config);
  SegmentConfig close = config;
  close.max_tilt_deg = std::min(config.max_tilt_deg, 4.0);
  std::vector<Sight> sights;
  for (const Direction& direction : likely_directions(reduced, prior, config))
    look_closely(turn_image(reduced, direction.x, direction.y), prior, close, sights);
  if (sights.empty())
    return job_failed(
        "no forging: no edges stand out {:.0f} to {:.0f} px apart with a {} body between; is the exposure right?",
        prior.diameter_min_px, prior.diameter_max_px, prior.polarity == Polarity::bright ? "bright" : "dark");
  // Of a body and a part of it, the part may look purer.
  const auto worth = [](const FoundBody& body) { return body.rating * std::sqrt(body.whole.length_px()); };
  std::sort(sights.begin(), sights.end(),
            [&](const Sight& a, const Sight& b) { return worth(a.body) > worth(b.body); });
  const auto best = std::find_if(sights.begin(), sights.end(), [&](const Sight& sight) {
    return check_body(sight.body, sight.working, config).has_value();
  });
  if (best == sights.end()) return pass_on(check_body(sights.front().body, sights.front().working, config).error());
  Segmentation found = describe(best->body.whole, best->body.axis, best->working, config);
  found.score = best->body.score;
  found.others = find_other_bodies(best->working, best->body, prior, config);
  return found;
}

}  // namespace imprint
