#include "node/edge/outside_level.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace imprint {
namespace {

constexpr int kNearPx = 2, kStripPx = 5;    // where a strip of scale would lie, outside the edge
constexpr int kFarPx = 7, kFarthestPx = 9;  // near enough that what stands behind seldom changes in between
constexpr int kAlong = 8;                   // lines on either side that are averaged
constexpr double kJumpPx = 1.0;             // between neighbouring lines: another stretch begins
constexpr int kStrip = kStripPx - kNearPx + 1;

// The strip's values less what the edge's own blur puts there, and the level further out.
struct Outside {
  std::array<double, kStrip> strip{};
  double far = 0.0;
  bool known = false;
};

Outside outside_of(const ScanLines& scan, const StepEdge& edge) {
  Outside out;
  const ScanLine& line = scan.lines[edge.line];
  const float* values = scan.samples(line);
  const double position = (edge.position_px - line.first_px) / scan.spacing_px;
  const int at = static_cast<int>(std::lround(position));
  const int per_px = std::max(1, static_cast<int>(std::lround(1.0 / scan.spacing_px)));
  if (at - kFarPx * per_px < 2 || at >= line.count) return out;
  std::array<float, kFarthestPx - kFarPx + 1> far{};
  std::size_t count = 0;
  for (int d = kFarPx; d <= kFarthestPx && at - d * per_px >= 0; ++d) far[count++] = values[at - d * per_px];
  const auto middle = far.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(far.begin(), middle, far.begin() + static_cast<std::ptrdiff_t>(count));
  out.far = *middle;
  for (int d = kNearPx; d <= kStripPx; ++d) {
    const double z = (at - d * per_px - position) * scan.spacing_px / edge.blur_px;
    const double tail = edge.step * 0.5 * std::erfc(-z / std::numbers::sqrt2);
    out.strip[static_cast<std::size_t>(d - kNearPx)] = values[at - d * per_px] - tail;
  }
  out.known = true;
  return out;
}

}  // namespace

std::vector<OutsideLevel> outside_levels(const ScanLines& scan, const std::vector<StepEdge>& edges) {
  std::vector<OutsideLevel> levels(edges.size());
  std::vector<Outside> outside;
  outside.reserve(edges.size());
  for (const StepEdge& edge : edges) outside.push_back(outside_of(scan, edge));
  const auto together = [&](std::size_t a, std::size_t b) {
    const ScanLine &p = scan.lines[edges[a].line], &q = scan.lines[edges[b].line];
    const double apart = q.index - p.index;
    return std::abs(apart) <= 3 &&
           std::abs(edges[b].position_px - edges[a].position_px - p.slope * apart) < kJumpPx * std::abs(apart);
  };
  for (std::size_t i = 0; i < edges.size(); ++i) {
    std::array<double, kStrip> strip{};
    double far = 0.0, step = 0.0, count = 0.0;
    const auto add = [&](std::size_t k) {
      if (!outside[k].known) return;
      for (std::size_t d = 0; d < kStrip; ++d) strip[d] += outside[k].strip[d];
      far += outside[k].far, step += edges[k].step, count += 1.0;
    };
    add(i);
    for (std::size_t k = i; k > 0 && i - k < kAlong && together(k, k - 1); --k) add(k - 1);
    for (std::size_t k = i; k + 1 < edges.size() && k - i < kAlong && together(k, k + 1); ++k) add(k + 1);
    if (!(count > 0.0) || !(step > 0.0)) continue;
    // Two neighbouring pixels have to agree.
    for (std::size_t d = 0; d + 1 < kStrip; ++d) {
      const double off = (0.5 * (strip[d] + strip[d + 1]) - far) / step;
      levels[i].dip = std::max(levels[i].dip, -off);
      levels[i].bump = std::max(levels[i].bump, off);
    }
  }
  return levels;
}

}  // namespace imprint
