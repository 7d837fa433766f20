#include "node/segment/body_search.h"

#include <algorithm>
#include <cmath>

#include "node/segment/body_levels.h"

namespace imprint {
namespace {

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

// A line that is followed, with what came of it.
struct Candidate {
  FoundBody body;
  double rating = 0.0;
};

// The body about its own axis, then once more with its brightness known.
void follow_again(Candidate& candidate, const RimPairs& pairs, const RimCandidates& rims, const WorkingImage& working,
                  const SegmentPrior& prior, double max_offset_px, const SegmentConfig& config) {
  FoundBody& body = candidate.body;
  body.axis = fit_axis(body.seen, body.axis);
  const auto about_axis = [&](float least_body) {
    return pairs_about_axis(pairs, working, rims, body.axis, max_offset_px, least_body, config.max_rims_per_column);
  };
  body.seen = follow_body(about_axis(least_body_level(body.seen, working, config)), working, body.axis, max_offset_px,
                          config.max_gap_diameters);
  candidate.rating = rate_body(body.seen, working, prior, config);
  body.whole = body.seen;
  if (body.seen.empty()) return;

  body.axis = fit_axis(body.seen, body.axis);
  const double width = body.seen.median_width_px();
  const float least_body = least_body_level(body.seen, working, config);
  // From a column that surely belongs to the body, as near to its middle as there is one.
  int inside = body.seen.columns.front().x_px, nearest = working.intensity.cols;
  const int middle = body.seen.columns[body.seen.columns.size() / 2].x_px;
  for (const auto& c : body.seen.columns)
    if (c.pair.both && c.pair.body >= least_body && std::abs(c.x_px - middle) < nearest)
      nearest = std::abs(c.x_px - middle), inside = c.x_px;
  const BodyLevels levels =
      measure_levels(working, body.axis, width, inside, least_body, 0.8 * config.max_gap_diameters * width);
  BodyPath refined = follow_body(weigh_by_levels(about_axis(least_body), working, levels), working, body.axis,
                                 max_offset_px, 2.0 * config.max_gap_diameters);
  candidate.rating = rate_body(refined, working, prior, config);
  if (refined.length_px() < 0.5 * body.seen.length_px()) return;
  fill_gaps(refined, rims_by_brightness(working, body.axis, levels, width), levels.first_x_px);
  body.whole = std::move(refined);
}

}  // namespace

AxisLine fit_axis(const BodyPath& path, const AxisLine& start) {
  AxisLine line = start;
  line.x0_px = 0.5 * (path.columns.front().x_px + path.columns.back().x_px);
  line.y0_px = start.y_px(line.x0_px);
  double scale = 2.0;  // reduced px
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
    scale = 1.0;
  }
  return line;
}

FoundBody find_body(const RimPairs& pairs, const RimCandidates& rims, const WorkingImage& working,
                    const SegmentPrior& prior, const SegmentConfig& config) {
  constexpr std::size_t kFollowedAgain = 5;
  const double max_offset_px = config.max_axis_bow * pairs.min_width_px + 3.0;
  std::vector<Candidate> candidates;
  for (const AxisLine& line : vote_axis_lines(pairs, working.intensity.rows, 0.3 * pairs.min_width_px, config)) {
    Candidate candidate;
    candidate.body.axis = line;
    candidate.body.seen = follow_body(pairs, working, line, max_offset_px, config.max_gap_diameters);
    candidate.rating = rate_body(candidate.body.seen, working, prior, config);
    if (!candidate.body.seen.empty()) candidates.push_back(std::move(candidate));
  }
  const auto better = [](const Candidate& a, const Candidate& b) { return a.rating > b.rating; };
  std::sort(candidates.begin(), candidates.end(), better);
  candidates.resize(std::min(candidates.size(), kFollowedAgain));
  for (Candidate& candidate : candidates) follow_again(candidate, pairs, rims, working, prior, max_offset_px, config);
  const auto best = std::min_element(candidates.begin(), candidates.end(), better);
  return best == candidates.end() ? FoundBody{} : std::move(best->body);
}

}  // namespace imprint
