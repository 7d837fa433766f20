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

// The last column of the body when walking from `from` in steps of `step`.
int walk(const BodyLevels& levels, int from, int step, float least_body, double max_gap_px) {
  constexpr float kStaysAbove = 0.6F, kMemory = 0.05F;  // of about 20 columns
  constexpr double kReturnShare = 0.6;
  const int n = static_cast<int>(levels.body.size());
  float brightness = levels.body[static_cast<std::size_t>(from)];
  int last = from, run = 0;
  for (int x = from; x >= 0 && x < n && std::abs(x - last) <= max_gap_px + run; x += step) {
    const float body = levels.body[static_cast<std::size_t>(x)], ground = levels.ground[static_cast<std::size_t>(x)];
    if (body < least_body || body - ground < kStaysAbove * (brightness - ground)) {
      run = 0;
      continue;
    }
    ++run;
    // Behind a gap the body goes on for about as long as the gap was; a lamp does not.
    const int gap = std::abs(x - last) - run;
    if (run < kReturnShare * gap) continue;
    brightness += kMemory * (body - brightness);
    last = x;
    run = 0;
  }
  return last;
}

float mean(const WorkingImage& working, int x, double from, double to) {
  std::vector<float> values;
  gather(working, x, from, to, values);
  float sum = 0;
  for (const float value : values) sum += value;
  return values.empty() ? 0.0F : sum / static_cast<float>(values.size());
}

// 0 to 1: the side `inner` of a rim belongs to the body and the side `outer` does not.
float rim_weight(float inner, float outer, float body, float ground) {
  const float contrast = std::max(body - ground, 1e-4F);
  const float belongs = std::clamp(((inner - ground) / contrast - 0.45F) / 0.3F, 0.0F, 1.0F);
  const float leaves = std::clamp((0.9F - (outer - ground) / contrast) / 0.3F, 0.0F, 1.0F);
  return belongs * leaves;
}

// Distance from the axis to where the body's brightness ends on one side of a column; darker stretches up to `gap_px`
// are scale.
double reach(const WorkingImage& working, const BodyLevels& levels, int x, double axis_y, int step, double limit_px,
             double gap_px) {
  const auto column = static_cast<std::size_t>(x);
  const float edge = levels.ground[column] + 0.6F * (levels.body[column] - levels.ground[column]);
  const int from = static_cast<int>(std::lround(axis_y));
  double last = 0.0;
  for (int k = 0; k <= limit_px && k - last <= gap_px; ++k) {
    const int y = from + step * k;
    if (y < 0 || y >= working.intensity.rows) break;
    if (working.intensity(y, x) > edge) last = k;
  }
  return last + 0.5;
}

}  // namespace

BodyLevels measure_levels(const WorkingImage& working, const AxisLine& line, double width_px, int inside_x_px,
                          float least_body, double max_gap_px) {
  constexpr double kStrip = 0.3;                        // of the width, to both sides of the axis: inside every step
  constexpr double kGroundFrom = 0.8, kGroundTo = 1.6;  // of the width: outside every step
  BodyLevels levels;
  std::vector<float> values;
  for (int x = 0; x < working.intensity.cols; ++x) {
    const double y = line.y_px(x);
    values.clear();
    gather(working, x, y - kStrip * width_px, y + kStrip * width_px, values);
    levels.body.push_back(quantile(values, 0.7));
    values.clear();
    gather(working, x, y - kGroundTo * width_px, y - kGroundFrom * width_px, values);
    gather(working, x, y + kGroundFrom * width_px, y + kGroundTo * width_px, values);
    levels.ground.push_back(quantile(values, 0.3));
  }
  levels.body = smoothed(levels.body, 2);
  levels.ground = smoothed(levels.ground, 8);
  levels.first_x_px = walk(levels, inside_x_px, -1, least_body, max_gap_px);
  levels.last_x_px = walk(levels, inside_x_px, 1, least_body, max_gap_px);
  // Over scale the body is as bright as beside it.
  for (int x = levels.first_x_px + 1; x < levels.last_x_px; ++x) {
    auto& body = levels.body[static_cast<std::size_t>(x)];
    const float ground = levels.ground[static_cast<std::size_t>(x)],
                before = levels.body[static_cast<std::size_t>(x - 1)];
    if (body - ground < 0.6F * (before - ground)) body = before;
  }
  return levels;
}

std::vector<RimPair> rims_by_brightness(const WorkingImage& working, const AxisLine& line, const BodyLevels& levels,
                                        double width_px) {
  constexpr int kHalfWindow = 10;    // columns: longer than a spark, shorter than a fitting
  constexpr double kOutward = 0.75;  // quantile over the window: scale only ever hides the rim
  const int n = levels.last_x_px - levels.first_x_px + 1;
  std::vector<float> above, below, window;
  for (int x = levels.first_x_px; x <= levels.last_x_px; ++x) {
    above.push_back(static_cast<float>(reach(working, levels, x, line.y_px(x), -1, width_px, 0.25 * width_px)));
    below.push_back(static_cast<float>(reach(working, levels, x, line.y_px(x), 1, width_px, 0.25 * width_px)));
  }
  std::vector<RimPair> rims;
  for (int k = 0; k < n; ++k) {
    const auto around = [&](const std::vector<float>& side) {
      window.assign(side.begin() + std::max(0, k - kHalfWindow), side.begin() + std::min(n, k + kHalfWindow + 1));
      return quantile(window, kOutward);
    };
    const auto axis_y = static_cast<float>(line.y_px(levels.first_x_px + k));
    RimPair pair;
    pair.both = false;
    pair.upper_px = axis_y - around(above);
    pair.lower_px = axis_y + around(below);
    rims.push_back(pair);
  }
  return rims;
}

RimPairs weigh_by_levels(const RimPairs& pairs, const WorkingImage& working, const BodyLevels& levels) {
  constexpr double kNear = 1.5, kFar = 4.0;  // reduced px off the rim: clear of its blur, still beside it
  RimPairs weighed = pairs;
  for (auto& column : weighed.columns) column.clear();
  for (int x = std::max(0, levels.first_x_px); x <= levels.last_x_px; ++x) {
    const auto column = static_cast<std::size_t>(x);
    for (RimPair pair : pairs.columns[column]) {
      const float body = levels.body[column], ground = levels.ground[column];
      const float upper = rim_weight(mean(working, x, pair.upper_px + kNear, pair.upper_px + kFar),
                                     mean(working, x, pair.upper_px - kFar, pair.upper_px - kNear), body, ground);
      const float lower = rim_weight(mean(working, x, pair.lower_px - kFar, pair.lower_px - kNear),
                                     mean(working, x, pair.lower_px + kNear, pair.lower_px + kFar), body, ground);
      pair.weight *= pair.both ? upper * lower : std::max(upper, lower);  // of a mirrored pair one is no rim
      if (pair.weight > 0.01F) weighed.columns[column].push_back(pair);
    }
  }
  return weighed;
}

}  // namespace imprint
