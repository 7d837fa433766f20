#include "node/segment/body_joints.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace imprint {

std::vector<BodyJoint> find_joints(const WorkingImage& working, const AxisLine& line, const BodyLevels& levels,
                                   double width_px) {
  constexpr std::size_t kRows = 24;
  constexpr double kStrip = 0.35;               // of the width, to both sides of the axis
  constexpr double kApart = 0.06, kOver = 0.1;  // of the width: a face leans and bulges by as much; what is compared
  constexpr float kLeast = 0.15F;               // of the contrast
  constexpr float kDark = 0.35F;                // likewise: the least level of what is no scale
  constexpr float kAlike = 0.4F;                // of the mean step: the least that a row shows of it
  constexpr double kShare = 0.87;               // of the rows that show it
  const int n = working.intensity.cols;
  const int apart = std::max(1, static_cast<int>(kApart * width_px)),
            over = std::max(3, static_cast<int>(kOver * width_px));
  const auto inside = static_cast<std::size_t>(levels.inside_x_px);
  const float ground = levels.ground[inside], contrast = std::max(1e-4F, levels.body[inside] - ground);
  std::vector<BodyJoint> joints;
  float strongest = 0;                         // of the last joint's columns: the one in its middle
  std::array<std::vector<float>, kRows> sums;  // along each row
  for (std::size_t r = 0; r < kRows; ++r) {
    const double off = (2.0 * static_cast<double>(r) / (kRows - 1) - 1) * kStrip * width_px;
    sums[r].assign(static_cast<std::size_t>(n) + 1, 0.0F);
    for (int x = 0; x < n; ++x) {
      const int y = std::clamp(static_cast<int>(std::lround(line.y_px(x) + off)), 0, working.intensity.rows - 1);
      sums[r][static_cast<std::size_t>(x) + 1] = sums[r][static_cast<std::size_t>(x)] + working.intensity(y, x);
    }
  }
  for (int x = apart + over; x + apart + over < n; ++x) {
    std::array<float, kRows> step{};
    float mean = 0;
    const auto at = [&](std::size_t r, int to) { return sums[r][static_cast<std::size_t>(to)]; };
    for (std::size_t r = 0; r < kRows; ++r) {
      step[r] = (at(r, x + apart + over) - at(r, x + apart) - at(r, x - apart) + at(r, x - apart - over)) /
                (static_cast<float>(over) * contrast);
      mean += step[r] / kRows;
    }
    if (std::abs(mean) < kLeast) continue;
    const auto alike = std::count_if(step.begin(), step.end(), [&](float s) { return s / mean > kAlike; });
    if (static_cast<double>(alike) < kShare * kRows) continue;
    float darker = 0;
    for (std::size_t r = 0; r < kRows; ++r)
      darker += (mean > 0 ? at(r, x - apart) - at(r, x - apart - over) : at(r, x + apart + over) - at(r, x + apart)) /
                (static_cast<float>(over) * kRows);
    const bool same = !joints.empty() && x - joints.back().x_px <= apart + over;
    if (same && std::abs(mean) <= strongest) continue;
    if (same) joints.pop_back();
    joints.push_back({x, darker < ground + kDark * contrast}), strongest = std::abs(mean);
  }
  return joints;
}

}  // namespace imprint
