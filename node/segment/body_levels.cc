#include "node/segment/body_levels.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

float quantile(std::vector<float>& values, double share) {
  if (values.empty()) return 0.0F;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The rows of one column between two heights, as far as the camera saw something there.
void gather(const WorkingImage& working, int x, double from, double to, std::vector<float>& values) {
  const int first = std::max(0, static_cast<int>(std::ceil(from)));
  const int last = std::min(working.intensity.rows - 1, static_cast<int>(std::floor(to)));
  for (int y = first; y <= last; ++y)
    if (working.valid(y, x)) values.push_back(working.intensity(y, x));
}

// Median over a few columns: sparks and single patches of scale go.
std::vector<float> smoothed(const std::vector<float>& values, int half) {
  std::vector<float> result(values.size()), window;
  const int n = static_cast<int>(values.size());
  for (int x = 0; x < n; ++x) {
    window.assign(values.begin() + std::max(0, x - half), values.begin() + std::min(n, x + half + 1));
    result[static_cast<std::size_t>(x)] = quantile(window, 0.5);
  }
  return result;
}

// Rows of one column inside every step of the forging.
void gather_inside(const WorkingImage& working, const AxisLine& line, double width_px, int x,
                   std::vector<float>& values) {
  constexpr double kStrip = 0.3;  // of the width, to both sides of the axis
  values.clear();
  gather(working, x, line.y_px(x) - kStrip * width_px, line.y_px(x) + kStrip * width_px, values);
}

// Follows the body from column to column, in either direction. Its level may drift, since ends are colder. The ground
// is the darker of what lies beside the column and what lay beside the columns before: clutter there must not hide the
// body's contrast.
class BodyWalk {
 public:
  BodyWalk(const WorkingImage& working, const AxisLine& line, double width_px, const BodyLevels& levels,
           float least_body)
      : working_(working), line_(line), width_px_(width_px), levels_(levels), least_body_(least_body) {}

  // The last column of the body, and its brightness from `from` on. Every column speaks for the body or against it; the
  // body ends where all of them together speak for it most. Scale speaks against it, but leaves something of a section
  // bright, and behind it the body goes on for longer than a lamp would; behind air only what is long of itself belongs
  // to it.
  int last_column(int from, int step, double max_gap_px, std::vector<float>& brightness) {
    const int n = static_cast<int>(levels_.body.size());
    start(from);
    const int gap = std::max(3, static_cast<int>(kGap * width_px_ / rarity_));
    double sum = 0, most = 0;
    int last = from, air = 0;
    for (int x = from; x >= 0 && x < n && most - sum <= rarity_ * (kAir * max_gap_px + kIsland * width_px_);
         x += step) {
      const double w = worth(x);
      brightness[static_cast<std::size_t>(x)] = brightness_;
      sum += w;
      air = w <= -kAir * rarity_ ? air + 1 : 0;
      if (air == gap) sum -= rarity_ * kIsland * width_px_;
      if (sum > most) most = sum, last = x;
    }
    return last;
  }

 private:
  static constexpr double kAir = 1.2;                 // against the body: a column that shows nothing of it
  static constexpr double kGap = 0.2, kIsland = 0.4;  // of the width: as many such columns are air; what pays for it
  static constexpr double kScale = 0.65, kTooBright = 1.0;   // likewise: a pixel that is darker, or brighter
  static constexpr float kDarker = 0.33F, kBrighter = 0.5F;  // of the contrast
  static constexpr float kLost = 0.3F;  // likewise, after half a width of unsure columns: it may have become colder
  static constexpr double kNothing = 0.15, kSurely = 0.5;  // of a column's pixels
  static constexpr float kGroundMemory = 0.01F;            // a beam behind the body is no ground
  static constexpr float kMemory = 0.05F;                  // of about 20 columns

  void start(int from) {
    const int half = std::max(2, static_cast<int>(0.5 * width_px_)), n = static_cast<int>(levels_.body.size());
    values_.clear();
    for (int x = std::max(0, from - half); x <= std::min(n - 1, from + half); ++x)
      values_.push_back(levels_.body[static_cast<std::size_t>(x)]);
    unsure_ = 0;
    brightness_ = std::max(least_body_, quantile(values_, 0.5));
    ground_ = levels_.ground[static_cast<std::size_t>(from)];
    rarity_ = rarity_of_scale(from);
  }

  // On a clean body a dark column is no scale: what darkness costs, as the logarithm of its share about column `from`.
  double rarity_of_scale(int from) {
    constexpr double kAbout = 3.0;    // of the width, to both sides
    constexpr double kScaled = 0.15;  // the share of a scaled body, which the costs were set for
    constexpr double kCleanest = 0.002, kMost = 3.5;
    const int reach = static_cast<int>(kAbout * width_px_), n = static_cast<int>(levels_.body.size());
    double dark = 0, all = 1;
    for (int x = std::max(0, from - reach); x <= std::min(n - 1, from + reach); ++x) {
      gather_inside(working_, line_, width_px_, x, values_);
      for (const float v : values_) dark += v < brightness_ - kDarker * (brightness_ - ground_), all += 1;
    }
    return std::clamp(std::log(std::max(kCleanest, dark / all)) / std::log(kScaled), 1.0, kMost);
  }

  double worth(int x) {
    gather_inside(working_, line_, width_px_, x, values_);
    if (values_.empty()) return -kAir * rarity_;
    const float ground = std::min(levels_.ground[static_cast<std::size_t>(x)], ground_);
    const float contrast = brightness_ - ground;
    const float darker = kDarker + kLost * std::min(1.0F, static_cast<float>(2.0 * unsure_ / width_px_));
    double same = 0, dark = 0, bright = 0, near = 0, sum = 0;
    for (const float v : values_) {
      const float off = (v - brightness_) / std::max(1e-4F, contrast);
      (off < -darker ? dark : off > kBrighter ? bright : same) += 1;
      if (std::abs(off) < kBrighter) near += 1, sum += v;
    }
    const auto count = static_cast<double>(values_.size());
    ++unsure_;
    if (same < kNothing * count) return -kAir * rarity_;
    if (same > kSurely * count && near > 0) {
      unsure_ = std::max(0, unsure_ - 4);
      brightness_ += kMemory * (static_cast<float>(sum / near) - brightness_);
      ground_ += kGroundMemory * (levels_.ground[static_cast<std::size_t>(x)] - ground_);
    }
    return (same - rarity_ * kScale * dark - kTooBright * bright) / count;
  }

  const WorkingImage& working_;
  const AxisLine& line_;
  double width_px_;
  const BodyLevels& levels_;
  float least_body_;
  float brightness_ = 0, ground_ = 0;
  double rarity_ = 1;  // of scale on the body, 1: it is scaled
  int unsure_ = 0;     // columns that were not surely the body's, less a few for each that was
  std::vector<float> values_;
};

}  // namespace

BodyLevels levels_between(const WorkingImage& working, const AxisLine& line, double width_px, int first_x_px,
                          int last_x_px) {
  constexpr double kGroundFrom = 0.8, kGroundTo = 1.6;  // of the width: outside every step
  BodyLevels levels;
  levels.first_x_px = first_x_px, levels.last_x_px = last_x_px;
  levels.body.assign(static_cast<std::size_t>(working.intensity.cols), 0.0F);
  levels.ground = levels.body;
  std::vector<float> values, body, ground;
  for (int x = first_x_px; x <= last_x_px; ++x) {
    const double y = line.y_px(x);
    gather_inside(working, line, width_px, x, values);
    body.push_back(quantile(values, 0.7));
    values.clear();
    gather(working, x, y - kGroundTo * width_px, y - kGroundFrom * width_px, values);
    gather(working, x, y + kGroundFrom * width_px, y + kGroundTo * width_px, values);
    ground.push_back(quantile(values, 0.3));
  }
  body = smoothed(body, 2), ground = smoothed(ground, 8);
  std::copy(body.begin(), body.end(), levels.body.begin() + first_x_px);
  std::copy(ground.begin(), ground.end(), levels.ground.begin() + first_x_px);
  return levels;
}

BodyLevels measure_levels(const WorkingImage& working, const AxisLine& line, double width_px, int inside_x_px,
                          float least_body, double max_gap_px) {
  BodyLevels levels = levels_between(working, line, width_px, 0, working.intensity.cols - 1);
  BodyWalk walk(working, line, width_px, levels, least_body);
  // Over scale the body is as bright as beside it.
  std::vector<float> brightness = levels.body;
  const int first = walk.last_column(inside_x_px, -1, max_gap_px, brightness);
  const int last = walk.last_column(inside_x_px, 1, max_gap_px, brightness);
  levels.first_x_px = first, levels.last_x_px = last, levels.inside_x_px = inside_x_px;
  levels.body = std::move(brightness);
  return levels;
}

}  // namespace imprint
