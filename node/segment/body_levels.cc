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

// The last column of the body when walking from `from` in steps of `step`. The ground is the darker of what lies beside
// the column and what lay beside the columns before: clutter there must not hide the body's contrast. Scale leaves
// something of a section bright; where nothing is, there is air, and what lies behind it is not the body.
int walk(const BodyLevels& levels, int from, int step, float least_body, double width_px, double max_gap_px) {
  constexpr float kBelow = 0.4F, kAbove = 0.6F, kMemory = 0.05F;  // of the contrast; memory of about 20 columns
  constexpr double kReturnShare = 0.6, kAir = 0.08;
  const int n = static_cast<int>(levels.body.size());
  const double most_air = std::max(2.0, kAir * width_px);
  float brightness = levels.body[static_cast<std::size_t>(from)],
        before = levels.ground[static_cast<std::size_t>(from)];
  int last = from, run = 0, air = 0;
  for (int x = from; x >= 0 && x < n && std::abs(x - last) <= max_gap_px + run && air <= most_air; x += step) {
    const auto column = static_cast<std::size_t>(x);
    const float body = levels.body[column], ground = levels.ground[column];
    const float contrast = brightness - std::min(ground, before), off = body - brightness;
    air = levels.peak[column] - brightness < -0.5F * contrast ? air + 1 : 0;
    if (body < least_body || off < -kBelow * contrast || off > kAbove * contrast) {
      run = 0;
      continue;
    }
    ++run;
    // Behind a gap the body goes on for about as long as the gap was; a lamp does not.
    const int gap = std::abs(x - last) - run;
    if (run < kReturnShare * gap) continue;
    brightness += kMemory * (body - brightness);
    before += kMemory * (ground - before);
    last = x;
    run = 0;
  }
  return last;
}

}  // namespace

BodyLevels levels_between(const WorkingImage& working, const AxisLine& line, double width_px, int first_x_px,
                          int last_x_px) {
  constexpr double kStrip = 0.3;                        // of the width, to both sides of the axis: inside every step
  constexpr double kGroundFrom = 0.8, kGroundTo = 1.6;  // of the width: outside every step
  BodyLevels levels;
  levels.first_x_px = first_x_px, levels.last_x_px = last_x_px;
  levels.body.assign(static_cast<std::size_t>(working.intensity.cols), 0.0F);
  levels.ground = levels.peak = levels.body;
  std::vector<float> values, body, ground, peak;
  for (int x = first_x_px; x <= last_x_px; ++x) {
    const double y = line.y_px(x);
    values.clear();
    gather(working, x, y - kStrip * width_px, y + kStrip * width_px, values);
    body.push_back(quantile(values, 0.7));
    peak.push_back(quantile(values, 0.92));
    values.clear();
    gather(working, x, y - kGroundTo * width_px, y - kGroundFrom * width_px, values);
    gather(working, x, y + kGroundFrom * width_px, y + kGroundTo * width_px, values);
    ground.push_back(quantile(values, 0.3));
  }
  body = smoothed(body, 2), peak = smoothed(peak, 2), ground = smoothed(ground, 8);
  std::copy(body.begin(), body.end(), levels.body.begin() + first_x_px);
  std::copy(peak.begin(), peak.end(), levels.peak.begin() + first_x_px);
  std::copy(ground.begin(), ground.end(), levels.ground.begin() + first_x_px);
  return levels;
}

BodyLevels measure_levels(const WorkingImage& working, const AxisLine& line, double width_px, int inside_x_px,
                          float least_body, double max_gap_px) {
  BodyLevels levels = levels_between(working, line, width_px, 0, working.intensity.cols - 1);
  levels.first_x_px = walk(levels, inside_x_px, -1, least_body, width_px, max_gap_px);
  levels.last_x_px = walk(levels, inside_x_px, 1, least_body, width_px, max_gap_px);
  // Over scale the body is as bright as beside it.
  for (int x = levels.first_x_px + 1; x < levels.last_x_px; ++x) {
    auto& body = levels.body[static_cast<std::size_t>(x)];
    const float ground = levels.ground[static_cast<std::size_t>(x)],
                before = levels.body[static_cast<std::size_t>(x - 1)];
    if (body - ground < 0.6F * (before - ground)) body = before;
  }
  return levels;
}

}  // namespace imprint
