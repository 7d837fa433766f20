#include "node/segment/body_extent.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "lib/geometry/median.h"
#include "node/segment/body_joints.h"

namespace imprint {
namespace {

constexpr float kInside = 3.0F;    // of a column: a width of log odds counts as many
constexpr float kEdge = 2.0F;      // log odds of a plain edge where the rim is
constexpr float kNoEdge = -0.7F;   // of none
constexpr float kPerPx = 1.2F;     // of moving both rims by a pixel each, on one side
constexpr float kColumn = 4.0F;    // what one side of a column of the body is usually worth
constexpr float kIgnored = 0.25F;  // of a jump: as many columns as this, of the width

// How much more often the body has a level than what lies about it, as a logarithm. Levels as a share of the step from
// ground to body. Where scale is as dark as the hall, darkness says nothing.
class LevelOdds {
 public:
  LevelOdds(const WorkingImage& working, const AxisLine& line, const BodyLevels& levels, double width_px) {
    constexpr double kInsideTo = 0.3, kOutsideFrom = 0.8, kOutsideTo = 1.6;  // of the width, from the axis
    constexpr double kAbout = 2.0;                                           // likewise, along it
    std::array<float, kBins> body{}, ground{};
    const int margin = (levels.last_x_px - levels.first_x_px) / 6;  // an end may lie behind the body's
    const int first = levels.first_x_px + margin, last = levels.last_x_px - margin;
    std::vector<double> grounds(levels.ground.begin() + first, levels.ground.begin() + std::max(first, last) + 1);
    ground_ = static_cast<float>(median(std::move(grounds)));
    std::array<float, kBins> middle{};  // where it surely is the body's
    const int about = static_cast<int>(kAbout * width_px);
    for (int x = std::max(levels.first_x_px, levels.inside_x_px - about);
         x <= std::min(levels.last_x_px, levels.inside_x_px + about); x += 2)
      count(working, levels, x, line.y_px(x) - kInsideTo * width_px, line.y_px(x) + kInsideTo * width_px, middle);
    clean_middle_ = is_clean(middle);
    for (int x = first; x <= last; x += 2) {
      const double y = line.y_px(x);
      count(working, levels, x, y - kInsideTo * width_px, y + kInsideTo * width_px, body);
      count(working, levels, x, y - kOutsideTo * width_px, y - kOutsideFrom * width_px, ground);
      count(working, levels, x, y + kOutsideFrom * width_px, y + kOutsideTo * width_px, ground);
    }
    clean_ = clean_middle_ && is_clean(body);
    // Of the body enough has been seen to know its levels; what lies behind its ends may have any.
    smooth(body, 0.01F), smooth(ground, 0.2F);
    for (std::size_t i = 0; i < kBins; ++i) odds_[i] = std::clamp(std::log(body[i] / ground[i]), -kSurely, kSure);
  }

  // Of a level where the body has the level `body`.
  [[nodiscard]] float of(float level, float body) const { return odds_[bin(level, body)]; }

  // Whether there is no scale anywhere, or where it surely is the body.
  [[nodiscard]] bool clean() const { return clean_; }
  [[nodiscard]] bool clean_middle() const { return clean_middle_; }

 private:
  static constexpr float kDark = 0.6F, kScaled = 0.02F;
  static constexpr std::size_t kBins = 40;
  static constexpr float kLowest = -1.0F, kPerBin = 0.1F, kSure = 3.0F, kSurely = 9.0F;

  [[nodiscard]] float share(float level, float body) const {
    return (level - ground_) / std::max(1e-4F, body - ground_);
  }
  [[nodiscard]] std::size_t bin(float level, float body) const {
    return static_cast<std::size_t>(
        std::clamp((share(level, body) - kLowest) / kPerBin, 0.0F, static_cast<float>(kBins - 1)));
  }
  void count(const WorkingImage& working, const BodyLevels& levels, int x, double from, double to,
             std::array<float, kBins>& counts) const {
    const float body = levels.body[static_cast<std::size_t>(x)];
    const int last = std::min(working.intensity.rows - 1, static_cast<int>(to));
    for (int y = std::max(0, static_cast<int>(std::ceil(from))); y <= last; y += 2)
      if (working.valid(y, x)) counts[bin(working.intensity(y, x), body)] += 1;
  }
  static bool is_clean(const std::array<float, kBins>& counts) {
    float dark = 0, all = 1;
    for (std::size_t i = 0; i < kBins; ++i) {
      all += counts[i];
      if (kLowest + kPerBin * static_cast<float>(i + 1) <= kDark) dark += counts[i];
    }
    return dark < kScaled * all;
  }
  // Shares, with neighbours' counts and what has not been seen yet.
  static void smooth(std::array<float, kBins>& counts, float unseen) {
    const std::array<float, kBins> seen = counts;
    float sum = 0;
    for (std::size_t i = 0; i < kBins; ++i) {
      counts[i] = 0.5F * seen[i] + 0.25F * (seen[i > 0 ? i - 1 : i] + seen[i + 1 < kBins ? i + 1 : i]);
      sum += counts[i];
    }
    for (float& c : counts) c = (1 - unseen) * c / std::max(1.0F, sum) + unseen / kBins;
  }

  std::array<float, kBins> odds_{};
  float ground_ = 0;
  bool clean_ = false, clean_middle_ = false;
};

// For each distance from the axis, how much one side of a column speaks for a body with its rim there.
void rate_column(const WorkingImage& working, int x, double axis_y, int step, float body, const LevelOdds& odds,
                 const std::vector<RimCandidate>& edges, float width, std::vector<float>& rating) {
  const int n = static_cast<int>(rating.size());
  const int from = static_cast<int>(std::lround(axis_y));
  const float per_px = kInside / width;
  float sum = 0;
  for (int k = 0; k < n; ++k) {
    const int y = from + step * k;
    const bool seen = y >= 0 && y < working.intensity.rows && working.valid(y, x);
    rating[static_cast<std::size_t>(k)] = sum + (seen ? kNoEdge : 0.0F);
    if (seen) sum += per_px * odds.of(working.intensity(y, x), body);
  }
  for (const RimCandidate& edge : edges) {
    const double k = step * (edge.y_px - axis_y) + 0.5;  // the first pixel behind the edge
    const int at = static_cast<int>(std::lround(k));
    if (at >= 0 && at < n)
      rating[static_cast<std::size_t>(at)] += (kEdge - kNoEdge) * std::min(1.0F, 2 * edge.strength);
  }
}

// The run of columns that together speak for the body most, its rims as far from the axis on both sides: a move costs
// by its length, at most `jump` (Viterbi with a truncated linear cost, each run begun anew where nothing speaks for
// it).
class BestRun {
 public:
  explicit BestRun(std::size_t reach) : gain_(reach, 0.0F), moved_(reach), begin_(reach, 0), begun_(reach) {}

  void add(int x, const std::vector<float>& rating, float per_px, float jump) {
    const std::size_t n = gain_.size();
    const auto top = static_cast<std::size_t>(std::max_element(gain_.begin(), gain_.end()) - gain_.begin());
    moved_ = gain_, begun_ = begin_;
    const auto offer = [&](std::size_t k, std::size_t beside) {
      if (moved_[beside] - per_px > moved_[k]) moved_[k] = moved_[beside] - per_px, begun_[k] = begun_[beside];
    };
    for (std::size_t k = 1; k < n; ++k) offer(k, k - 1);
    for (std::size_t k = n - 1; k > 0; --k) offer(k - 1, k);
    const float best = gain_[top] - jump;
    const int best_begin = begin_[top];
    for (std::size_t k = 0; k < n; ++k) {
      if (best > moved_[k]) moved_[k] = best, begun_[k] = best_begin;
      if (moved_[k] <= 0) moved_[k] = 0, begun_[k] = x;
      gain_[k] = moved_[k] + rating[k], begin_[k] = begun_[k];
      if (gain_[k] > most_) most_ = gain_[k], first_ = begun_[k], last_ = x;
    }
  }

  [[nodiscard]] BodyExtent extent() const { return {first_, last_}; }

 private:
  std::vector<float> gain_, moved_;
  std::vector<int> begin_, begun_;
  float most_ = 0;
  int first_ = 0, last_ = -1;
};

}  // namespace

BodyExtent extent_of_body(const WorkingImage& working, const AxisLine& line, const BodyLevels& levels,
                          const RimCandidates& rims, double width_px, double half_min_px, double half_max_px) {
  BodyExtent extent{levels.first_x_px, levels.last_x_px};
  if (extent.last_x_px < extent.first_x_px) return extent;
  const auto reach = static_cast<std::size_t>(std::max(4.0, half_max_px + 1));
  const auto least = std::min(reach, static_cast<std::size_t>(half_min_px));
  const auto width = static_cast<float>(std::max(8.0, width_px));
  const float jump = kColumn * std::max(4.0F, kIgnored * width);
  const LevelOdds odds(working, line, levels, width_px);
  BestRun run(reach);
  std::vector<float> upper(reach), lower(reach);
  for (int x = 0; x < working.intensity.cols; ++x) {
    // Behind its ends the body would go on as bright as there.
    const float body = levels.body[static_cast<std::size_t>(std::clamp(x, levels.first_x_px, levels.last_x_px))];
    const auto column = static_cast<std::size_t>(x);
    rate_column(working, x, line.y_px(x), -1, body, odds, rims.upper[column], width, upper);
    rate_column(working, x, line.y_px(x), 1, body, odds, rims.lower[column], width, lower);
    for (std::size_t k = 0; k < reach; ++k) upper[k] = k < least ? -2 * jump : upper[k] + lower[k];
    run.add(x, upper, 2 * kPerPx, 2 * jump);
  }
  const BodyExtent seen = run.extent();
  if (seen.first_x_px <= levels.inside_x_px && levels.inside_x_px <= seen.last_x_px) {
    extent.first_x_px = std::min(extent.first_x_px, seen.first_x_px);
    extent.last_x_px = std::max(extent.last_x_px, seen.last_x_px);
  }
  if (!odds.clean_middle()) return extent;
  for (const BodyJoint& joint : find_joints(working, line, levels, width_px)) {
    if (joint.to_dark && !odds.clean()) continue;
    if (joint.x_px < levels.inside_x_px - 0.5 * width_px) extent.first_x_px = std::max(extent.first_x_px, joint.x_px);
    if (joint.x_px > levels.inside_x_px + 0.5 * width_px) extent.last_x_px = std::min(extent.last_x_px, joint.x_px);
  }
  return extent;
}

}  // namespace imprint
