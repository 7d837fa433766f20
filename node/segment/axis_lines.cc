#include "node/segment/axis_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace imprint {
namespace {

// Means of the column's pixels between two rows, from running sums.
class ColumnSums {
 public:
  ColumnSums(const cv::Mat_<float>& image, int x) : sum_(static_cast<std::size_t>(image.rows) + 1, 0.0) {
    for (int y = 0; y < image.rows; ++y)
      sum_[static_cast<std::size_t>(y) + 1] = sum_[static_cast<std::size_t>(y)] + image(y, x);
  }
  [[nodiscard]] double mean(double from, double to) const {
    const int last = static_cast<int>(sum_.size()) - 2;
    const int a = std::clamp(static_cast<int>(std::lround(from)), 0, last);
    const int b = std::clamp(static_cast<int>(std::lround(to)), a, last);
    return (sum_[static_cast<std::size_t>(b) + 1] - sum_[static_cast<std::size_t>(a)]) / (b - a + 1);
  }

 private:
  std::vector<double> sum_;
};

float upper_quartile(const cv::Mat_<float>& image, int x, float upper_px, float lower_px) {
  std::array<float, 64> values{};
  const int from = std::clamp(static_cast<int>(upper_px) + 2, 0, image.rows - 1);
  const int to = std::clamp(static_cast<int>(lower_px) - 2, from, image.rows - 1);
  const int every = (to - from) / 64 + 1;
  int count = 0;
  for (int y = from; y <= to && count < 64; y += every) values[static_cast<std::size_t>(count++)] = image(y, x);
  const auto quartile = values.begin() + 3 * count / 4;
  std::nth_element(values.begin(), quartile, values.begin() + count);
  return *quartile;
}

// How much of the inside is brighter than the level halfway between outside and rim, 0 to 1. Two bodies with
// a gap between them, or the rim of one and the rim of another, fail here.
double inside_weight(const cv::Mat_<float>& image, int x, const ColumnSums& sums, RimPair& pair) {
  const double width = pair.lower_px - pair.upper_px;
  const double band = std::max(2.0, 0.06 * width);
  const double above = sums.mean(pair.upper_px - 2 - band, pair.upper_px - 2);
  const double below = sums.mean(pair.lower_px + 2, pair.lower_px + 2 + band);
  const double at_upper = sums.mean(pair.upper_px + 2, pair.upper_px + 2 + band);
  const double at_lower = sums.mean(pair.lower_px - 2 - band, pair.lower_px - 2);
  const double outside = std::max(above, below);
  const double step = std::min(at_upper - above, at_lower - below);
  if (step <= 0) return 0.0;
  pair.step = static_cast<float>(step);
  const double level = std::min(outside, 0.5 * (above + below) + step) + 0.3 * step;
  int bright = 0, count = 0;
  const int from = static_cast<int>(pair.upper_px) + 2, to = static_cast<int>(pair.lower_px) - 2;
  for (int y = from; y <= to; y += 2, ++count) bright += image(y, x) > level;
  const double share = count > 0 ? static_cast<double>(bright) / count : 0.0;
  return std::clamp((share - 0.3) / 0.35, 0.0, 1.0);
}

// Weights by contrast: one half for a third of the step of the strongest pairs, at most for kPlainStep.
void weigh_contrast(RimPairs& pairs) {
  std::vector<float> steps;
  for (const auto& column : pairs.columns)
    for (const RimPair& pair : column) steps.push_back(pair.step);
  if (steps.empty()) return;
  const auto high = steps.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(steps.size() - 1));
  std::nth_element(steps.begin(), high, steps.end());
  constexpr float kPlainStep = 0.05F;  // share of full scale: half of the faintest forging to be found
  pairs.half_step = std::min(*high / 3, kPlainStep);
  for (auto& column : pairs.columns)
    for (RimPair& pair : column) pair.weight *= pair.step / (pair.step + pairs.half_step);
}

}  // namespace

RimPairs pair_rims(const WorkingImage& working, const RimCandidates& rims, double min_width_px, double max_width_px) {
  RimPairs pairs;
  pairs.columns.resize(rims.upper.size());
  pairs.min_width_px = min_width_px, pairs.max_width_px = max_width_px;
  for (std::size_t x = 0; x < rims.upper.size(); ++x) {
    if (rims.upper[x].empty() || rims.lower[x].empty()) continue;
    const ColumnSums sums(working.intensity, static_cast<int>(x));
    for (const RimCandidate& upper : rims.upper[x]) {
      for (const RimCandidate& lower : rims.lower[x]) {
        const float width = lower.y_px - upper.y_px;
        if (width < min_width_px || width > max_width_px) continue;
        RimPair pair{upper.y_px, lower.y_px, std::sqrt(upper.strength * lower.strength)};
        pair.weight *= static_cast<float>(inside_weight(working.intensity, static_cast<int>(x), sums, pair));
        if (!(pair.weight > 0.05F)) continue;
        pair.body = upper_quartile(working.intensity, static_cast<int>(x), pair.upper_px, pair.lower_px);
        pairs.columns[x].push_back(pair);
      }
    }
  }
  weigh_contrast(pairs);
  return pairs;
}

RimPairs pairs_about_axis(const RimPairs& pairs, const WorkingImage& working, const RimCandidates& rims,
                          const AxisLine& line, double max_offset_px, float least_body, int max_count) {
  constexpr float kLoneRim = 0.4F;  // one rim is less than half of a pair
  RimPairs near;
  near.columns.resize(pairs.columns.size());
  near.min_width_px = pairs.min_width_px, near.max_width_px = pairs.max_width_px, near.half_step = pairs.half_step;
  for (std::size_t x = 0; x < pairs.columns.size(); ++x) {
    auto& column = near.columns[x];
    const auto axis = static_cast<float>(line.y_px(static_cast<double>(x)));
    for (RimPair pair : pairs.columns[x]) {
      const float off = pair.middle_px() - axis;
      if (pair.body < least_body || std::abs(off) > max_offset_px) continue;
      // Steps of a forging share its axis; a rim with something else's edge has its middle elsewhere.
      const float z = off / (1.0F + 0.04F * pair.width_px());
      pair.weight /= 1 + z * z;
      column.push_back(pair);
    }
    if (rims.upper[x].empty() && rims.lower[x].empty()) continue;
    const ColumnSums sums(working.intensity, static_cast<int>(x));
    for (const bool upper : {true, false}) {
      for (const RimCandidate& rim : upper ? rims.upper[x] : rims.lower[x]) {
        const float inward = upper ? 1.0F : -1.0F, half = inward * (axis - rim.y_px);
        if (2 * half < pairs.min_width_px || 2 * half > pairs.max_width_px) continue;
        const auto band = [&](float from, float to) {
          const float a = rim.y_px + inward * from, b = rim.y_px + inward * to;
          return static_cast<float>(sums.mean(std::min(a, b), std::max(a, b)));
        };
        const float outside = band(-4, -2), step = band(2, 4) - outside;
        if (step <= 0) continue;
        const float body = band(0.2F * half, half) - outside;  // goes on to the axis
        const float inside = std::clamp(body / step, 0.0F, 1.0F);
        const float y_upper = upper ? rim.y_px : 2 * axis - rim.y_px, y_lower = 2 * axis - y_upper;
        RimPair pair{y_upper, y_lower, 0, upper_quartile(working.intensity, static_cast<int>(x), y_upper, y_lower),
                     step,    false};
        if (pair.body < least_body) continue;
        pair.weight = kLoneRim * rim.strength * inside * step / (step + pairs.half_step);
        if (pair.weight > 0.03F) column.push_back(pair);
      }
    }
    if (column.size() <= static_cast<std::size_t>(max_count)) continue;
    std::nth_element(column.begin(), column.begin() + max_count, column.end(),
                     [](const RimPair& a, const RimPair& b) { return a.weight > b.weight; });
    column.resize(static_cast<std::size_t>(max_count));
  }
  return near;
}

std::vector<AxisLine> vote_axis_lines(const RimPairs& pairs, int height_px, double separation_px,
                                      const SegmentConfig& config) {
  constexpr double kBinPx = 2.0, kAngleStepDeg = 0.5;
  const int half_angles = static_cast<int>(std::ceil(config.max_tilt_deg / kAngleStepDeg));
  const int angles = 2 * half_angles + 1;
  const double x0 = 0.5 * static_cast<double>(pairs.columns.size());
  const double margin = x0 * std::tan(config.max_tilt_deg * std::numbers::pi / 180);
  const int bins = static_cast<int>((height_px + 2 * margin) / kBinPx) + 2;

  struct Cell {
    float votes = 0, last = 0;
    int column = -1;
  };
  std::vector<Cell> cells(static_cast<std::size_t>(angles) * static_cast<std::size_t>(bins));
  std::vector<double> slopes(static_cast<std::size_t>(angles));
  for (int a = 0; a < angles; ++a)
    slopes[static_cast<std::size_t>(a)] = std::tan((a - half_angles) * kAngleStepDeg * std::numbers::pi / 180);
  for (std::size_t x = 0; x < pairs.columns.size(); ++x) {
    for (const RimPair& pair : pairs.columns[x]) {
      for (int a = 0; a < angles; ++a) {
        const double y = pair.middle_px() - slopes[static_cast<std::size_t>(a)] * (static_cast<double>(x) - x0);
        const int bin = static_cast<int>((y + margin) / kBinPx);
        if (bin < 0 || bin >= bins) continue;
        Cell& cell =
            cells[static_cast<std::size_t>(a) * static_cast<std::size_t>(bins) + static_cast<std::size_t>(bin)];
        if (cell.column != static_cast<int>(x)) cell.column = static_cast<int>(x), cell.last = 0;
        if (pair.weight > cell.last) cell.votes += pair.weight - cell.last, cell.last = pair.weight;
      }
    }
  }

  // A bowed axis spreads over neighbouring bins: sum three.
  std::vector<float> votes(cells.size(), 0.0F);
  for (int a = 0; a < angles; ++a)
    for (int b = 1; b + 1 < bins; ++b) {
      const std::size_t i = static_cast<std::size_t>(a) * static_cast<std::size_t>(bins) + static_cast<std::size_t>(b);
      votes[i] = cells[i - 1].votes + cells[i].votes + cells[i + 1].votes;
    }
  std::vector<AxisLine> lines;
  while (static_cast<int>(lines.size()) < config.axis_candidates) {
    const auto best = std::max_element(votes.begin(), votes.end());
    if (best == votes.end() || *best <= 0) break;
    const auto index = static_cast<int>(best - votes.begin());
    const int a = index / bins, b = index % bins;
    lines.push_back({x0, (b + 0.5) * kBinPx - margin, slopes[static_cast<std::size_t>(a)], *best});
    // Another line through the same middle may still be another body's: steeper or flatter by some degrees.
    const int apart = std::max(1, static_cast<int>(separation_px / kBinPx)),
              turned = static_cast<int>(1.0 / kAngleStepDeg);
    for (int other = std::max(0, a - turned); other <= std::min(angles - 1, a + turned); ++other)
      for (int c = std::max(0, b - apart); c <= std::min(bins - 1, b + apart); ++c)
        votes[static_cast<std::size_t>(other) * static_cast<std::size_t>(bins) + static_cast<std::size_t>(c)] = 0.0F;
  }
  return lines;
}

}  // namespace imprint
