#include "node/segment/body_search.h"

#include <algorithm>
#include <cmath>

#include "lib/geometry/median.h"
#include "node/segment/body_levels.h"
#include "node/segment/body_rims.h"

namespace imprint {
namespace {

// What a body's shape and place say.
struct BodyPlace {
  double elongation = 0.0;  // length over width
  double off_range = 1.0;   // how many times too wide or too narrow, at least 1
  double off_middle = 0.0;  // of the image, 1: by `center_reach`
};

BodyPlace place_of(const BodyPath& path, const WorkingImage& working, const SegmentPrior& prior,
                   const SegmentConfig& config) {
  BodyPlace place;
  const double width = path.median_width_px(), width_px = width * working.reduction;
  place.elongation = path.length_px() / std::max(1.0, width);
  const double low = prior.likely_min_px > 0 ? prior.likely_min_px : prior.diameter_min_px;
  const double high = prior.likely_max_px > 0 ? prior.likely_max_px : prior.diameter_max_px;
  place.off_range = std::max({1.0, low / width_px, width_px / high});
  const cv::Size size = working.intensity.size();
  double nearest = 1e18;
  for (const auto& c : path.columns)
    nearest = std::min(nearest, std::hypot(c.x_px - 0.5 * size.width, c.pair.middle_px() - 0.5 * size.height));
  place.off_middle = nearest / (config.center_reach * working.shorter_side_px);
  return place;
}

// How well a body fits what is looked for, 0 to 1: proven along its length, elongated, of a likely width, and near
// where the cameras of a rig are pointed.
double rate_body(const BodyPath& path, const BodyProof& proof, const WorkingImage& working, const SegmentPrior& prior,
                 const SegmentConfig& config) {
  if (path.empty()) return 0.0;
  const BodyPlace place = place_of(path, working, prior, config);
  const double by_length = place.elongation / (place.elongation + config.half_elongation);
  const double by_width = 1.0 / (place.off_range * place.off_range);
  const double solid = std::clamp((proof.filled - 0.35) / 0.35, 0.0, 1.0);
  const double by_contrast = proof.contrast / (proof.contrast + config.faint_contrast);
  return proof.sides * solid * by_contrast * by_length * by_width / (1 + place.off_middle * place.off_middle);
}

// The probability that the body is the forging and its outline right: a logistic regression over rendered frames and
// empty halls (`./dev bench segmentation`, seeds 1 and 2). On other scenes it is a little too sure: it states 95 % of
// what is found where 90 to 93 % is right.
double probability_of(const BodyPath& path, const BodyProof& proof, const WorkingImage& working,
                      const SegmentPrior& prior, const SegmentConfig& config) {
  if (path.empty()) return 0.0;
  constexpr double kLong = 6.0;  // widths: more does not tell
  const BodyPlace place = place_of(path, working, prior, config);
  const auto log_of = [](double value, double least) { return std::log(std::max(value, least)); };
  const double logit = 6.3 + 9.9 * log_of(proof.sides, 0.05) + 6.3 * log_of(proof.filled, 0.05) +
                       0.9 * log_of(proof.contrast, 0.002) +
                       4.0 * std::log(std::clamp(place.elongation / kLong, 0.05, 1.0)) -
                       20.0 * std::log(place.off_range) - 8.4 * std::log1p(place.off_middle * place.off_middle);
  return 1.0 / (1.0 + std::exp(-logit));
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

// Cuts off what goes on behind an end: from `inside_x_px` outwards, where over a third of the width brightness and
// width change together (a jaw), or the width leaves what one forging at one distance can have.
void cut_ends(BodyPath& path, const BodyLevels& levels, int inside_x_px) {
  if (path.empty()) return;
  const double width = path.median_width_px();
  constexpr double kJaw = 1.7;  // of the usual width: more than a forging has in steps
  const int n = static_cast<int>(path.columns.size()), span = std::max(4, static_cast<int>(width));
  const double dark = levels.ground[static_cast<std::size_t>(inside_x_px)];
  const auto level = [&](int i) {
    const auto x = static_cast<std::size_t>(path.columns[static_cast<std::size_t>(i)].x_px);
    return static_cast<double>(levels.body[x]) - dark;
  };
  const auto width_at = [&](int i) {
    return static_cast<double>(path.columns[static_cast<std::size_t>(i)].pair.width_px());
  };
  const auto median = [&](int from, int to, auto value) {
    std::vector<double> values;
    for (int i = std::max(0, std::min(from, to)); i <= std::min(n - 1, std::max(from, to)); ++i)
      values.push_back(value(i));
    return imprint::median(std::move(values));
  };
  const int inside = std::clamp(inside_x_px - path.columns.front().x_px, 0, n - 1);
  int ends[2] = {0, n - 1};
  for (const int side : {0, 1}) {
    const int step = side == 0 ? -1 : 1;
    for (int i = inside; i >= 0 && i < n; i += step) {
      const double before = median(i - step * span, i - step, width_at),
                   behind = median(i + step, i + step * span, width_at);
      if (std::abs(i - inside) < span / 2 || behind <= 0) continue;
      const double change =
          median(i + step, i + step * span, level) / std::max(1e-6, median(i - step * span, i - step, level));
      const bool other_level = change < 0.7 || change > 1.4;
      if ((behind > 1.5 * before && other_level) || behind > kJaw * width) {
        // The window looks ahead: up to where the width itself changes.
        while (i + step >= 0 && i + step < n && width_at(i + step) < 1.25 * before) i += step;
        ends[side] = i;
        break;
      }
    }
  }
  path.columns = {path.columns.begin() + ends[0], path.columns.begin() + ends[1] + 1};
}

// Cuts off what goes on behind an end without proof: on either side of `inside_x_px` the body ends where its columns
// together speak for it most. Whether anything was cut.
bool cut_unproven(BodyPath& path, const BodyProof& proof, int inside_x_px) {
  constexpr double kNeither = 0.46;  // a column that speaks neither for the body nor against it
  if (path.empty()) return false;
  const int n = static_cast<int>(path.columns.size());
  const int inside = std::clamp(inside_x_px - path.columns.front().x_px, 0, n - 1);
  int ends[2] = {inside, inside};
  for (const int side : {0, 1}) {
    double sum = 0, most = 0;
    for (int i = inside; i >= 0 && i < n; i += side == 0 ? -1 : 1) {
      sum += static_cast<double>(proof.columns[static_cast<std::size_t>(i)]) - kNeither;
      if (sum > most) most = sum, ends[side] = i;
    }
  }
  path.columns = {path.columns.begin() + ends[0], path.columns.begin() + ends[1] + 1};
  return static_cast<int>(path.columns.size()) < n;
}

// The body about its own axis, then once more with its brightness known.
void follow_again(FoundBody& body, const RimPairs& pairs, const RimCandidates& rims, const WorkingImage& working,
                  const SegmentPrior& prior, double max_offset_px, const SegmentConfig& config) {
  body.axis = fit_axis(body.seen, body.axis);
  const auto about_axis = [&](float least_body) {
    return pairs_about_axis(pairs, working, rims, body.axis, max_offset_px, least_body, config.max_rims_per_column);
  };
  body.seen = follow_body(about_axis(least_body_level(body.seen, working, config)), working, body.axis, max_offset_px,
                          config.max_gap_diameters);
  body.rating = 0.0;
  body.whole = body.seen;
  if (body.seen.empty()) return;

  body.axis = fit_axis(body.seen, body.axis);
  const double width = body.seen.median_width_px();
  const float least_body = least_body_level(body.seen, working, config);
  // From a column that surely belongs to the body, and not to a jaw: as near to its middle as a bright one is.
  std::vector<double> bodies;
  for (const auto& c : body.seen.columns) bodies.push_back(c.pair.body);
  const double usual = median(std::move(bodies));
  int inside = body.seen.columns.front().x_px, nearest = working.intensity.cols;
  const int middle = body.seen.columns[body.seen.columns.size() / 2].x_px;
  for (const auto& c : body.seen.columns)
    if (c.pair.both && c.pair.body >= std::max<double>(least_body, usual) && std::abs(c.x_px - middle) < nearest)
      nearest = std::abs(c.x_px - middle), inside = c.x_px;
  // What was seen may have been a part of the body, or have had a wrong rim: the whole tells where the axis is.
  constexpr int kPasses = 3;
  constexpr double kAxisHolds = 0.05;  // of the width
  constexpr float kUnproven = 0.05F;   // weight of a column without both rims
  BodyLevels levels;
  for (int pass = 0; pass < kPasses; ++pass) {
    levels = measure_levels(working, body.axis, width, inside, least_body, config.max_gap_diameters * width);
    body.whole =
        trace_rims(working, body.axis, levels, rims, width, 0.4 * pairs.min_width_px, 0.6 * pairs.max_width_px);
    cut_ends(body.whole, levels, inside);
    body.proof = prove_body(body.whole, working, levels);
    if (cut_unproven(body.whole, body.proof, inside)) body.proof = prove_body(body.whole, working, levels);
    if (body.whole.empty()) break;
    for (auto& column : body.whole.columns) column.pair.weight = column.pair.both ? 1.0F : kUnproven;
    const AxisLine refined = fit_axis(body.whole, body.axis);
    const double first = body.whole.columns.front().x_px, last = body.whole.columns.back().x_px;
    const double moved = std::max(std::abs(refined.y_px(first) - body.axis.y_px(first)),
                                  std::abs(refined.y_px(last) - body.axis.y_px(last)));
    if (moved < kAxisHolds * width) break;
    body.axis = refined;
  }
  body.rating = rate_body(body.whole, body.proof, working, prior, config);
  body.score = probability_of(body.whole, body.proof, working, prior, config);
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

std::vector<FoundBody> glimpse_bodies(const RimPairs& pairs, const WorkingImage& working, const SegmentPrior& prior,
                                      const SegmentConfig& config) {
  const double max_offset_px = config.max_axis_bow * pairs.min_width_px + 3.0;
  std::vector<FoundBody> bodies;
  for (const AxisLine& line : vote_axis_lines(pairs, working.intensity.rows, 0.3 * pairs.min_width_px, config)) {
    FoundBody body;
    body.axis = line;
    body.seen = follow_body(pairs, working, line, max_offset_px, config.max_gap_diameters);
    if (body.seen.empty()) continue;
    const double width = body.seen.median_width_px();
    body.proof =
        prove_body(body.seen, working,
                   levels_between(working, line, width, body.seen.columns.front().x_px, body.seen.columns.back().x_px));
    body.rating = rate_body(body.seen, body.proof, working, prior, config);
    bodies.push_back(std::move(body));
  }
  std::sort(bodies.begin(), bodies.end(), [](const FoundBody& a, const FoundBody& b) { return a.rating > b.rating; });
  return bodies;
}

namespace {

// The best `count` bodies, leaving out those that lie along one that rates better.
void keep_distinct(std::vector<FoundBody>& bodies, std::size_t count) {
  constexpr double kSameSlope = 0.04;
  std::vector<FoundBody> kept;
  for (FoundBody& body : bodies) {
    if (kept.size() == count) break;
    const double x = body.seen.columns[body.seen.columns.size() / 2].x_px;
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const FoundBody& k) {
      return x >= k.seen.columns.front().x_px && x <= k.seen.columns.back().x_px &&
             std::abs(k.axis.y_px(x) - body.axis.y_px(x)) < 0.2 * k.seen.median_width_px() &&
             std::abs(k.axis.slope - body.axis.slope) < kSameSlope;
    });
    if (!known) kept.push_back(std::move(body));
  }
  bodies = std::move(kept);
}

}  // namespace

std::vector<FoundBody> find_bodies(const RimPairs& pairs, const RimCandidates& rims, const WorkingImage& working,
                                   const SegmentPrior& prior, const SegmentConfig& config) {
  constexpr std::size_t kFollowedAgain = 5;
  const double max_offset_px = config.max_axis_bow * pairs.min_width_px + 3.0;
  std::vector<FoundBody> bodies = glimpse_bodies(pairs, working, prior, config);
  keep_distinct(bodies, kFollowedAgain);
  for (FoundBody& body : bodies) follow_again(body, pairs, rims, working, prior, max_offset_px, config);
  std::sort(bodies.begin(), bodies.end(), [](const FoundBody& a, const FoundBody& b) { return a.rating > b.rating; });
  return bodies;
}

}  // namespace imprint
