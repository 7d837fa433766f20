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

// The strip's values less what the edge's own blur puts there, and the level further away from the edge.
struct Beside {
  std::array<double, kStrip> strip{};
  double far = 0.0;
  bool known = false;
};

// `way`: -1 outside the edge, 1 inside.
Beside beside(const ScanLines& scan, const StepEdge& edge, int way) {
  Beside seen;
  const ScanLine& line = scan.lines[edge.line];
  const float* values = scan.samples(line);
  const double position = (edge.position_px - line.first_px) / scan.spacing_px;
  const int at = static_cast<int>(std::lround(position));
  const int per_px = std::max(1, static_cast<int>(std::lround(1.0 / scan.spacing_px)));
  const auto within = [&](int i) { return i >= 0 && i < line.count; };
  if (!within(at) || !within(at + way * (kFarPx * per_px + 2))) return seen;
  std::array<float, kFarthestPx - kFarPx + 1> far{};
  std::size_t count = 0;
  for (int d = kFarPx; d <= kFarthestPx && within(at + way * d * per_px); ++d)
    far[count++] = values[at + way * d * per_px];
  const auto middle = far.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(far.begin(), middle, far.begin() + static_cast<std::ptrdiff_t>(count));
  seen.far = *middle;
  for (int d = kNearPx; d <= kStripPx; ++d) {
    const int i = at + way * d * per_px;
    const double z = std::abs(i - position) * scan.spacing_px / edge.blur_px;
    const double tail = edge.step * 0.5 * std::erfc(z / std::numbers::sqrt2);
    seen.strip[static_cast<std::size_t>(d - kNearPx)] = values[i] + way * tail;
  }
  seen.known = true;
  return seen;
}

}  // namespace

std::vector<OutsideLevel> outside_levels(const ScanLines& scan, const std::vector<StepEdge>& edges) {
  std::vector<OutsideLevel> levels(edges.size());
  std::vector<Beside> outside, inside;
  for (const StepEdge& edge : edges) {
    outside.push_back(beside(scan, edge, -1));
    inside.push_back(beside(scan, edge, 1));
  }
  const auto together = [&](std::size_t a, std::size_t b) {
    const ScanLine &p = scan.lines[edges[a].line], &q = scan.lines[edges[b].line];
    const double apart = q.index - p.index;
    return std::abs(apart) <= 3 &&
           std::abs(edges[b].position_px - edges[a].position_px - p.slope * apart) < kJumpPx * std::abs(apart);
  };
  for (std::size_t i = 0; i < edges.size(); ++i) {
    struct Sum {
      std::array<double, kStrip> strip{};
      double far = 0.0, step = 0.0;
      void add(const Beside& seen, double edge_step) {
        if (!seen.known) return;
        for (std::size_t d = 0; d < kStrip; ++d) strip[d] += seen.strip[d];
        far += seen.far, step += edge_step;
      }
      // Two neighbouring pixels have to agree.
      [[nodiscard]] double off(std::size_t d) const { return (0.5 * (strip[d] + strip[d + 1]) - far) / step; }
    };
    Sum out, in;
    const auto add = [&](std::size_t k) { out.add(outside[k], edges[k].step), in.add(inside[k], edges[k].step); };
    add(i);
    for (std::size_t k = i; k > 0 && i - k < kAlong && together(k, k - 1); --k) add(k - 1);
    for (std::size_t k = i; k + 1 < edges.size() && k - i < kAlong && together(k, k + 1); ++k) add(k + 1);
    for (std::size_t d = 0; d + 1 < kStrip; ++d) {
      if (out.step > 0.0) levels[i].dip = std::max(levels[i].dip, -out.off(d));
      if (out.step > 0.0) levels[i].bump = std::max(levels[i].bump, out.off(d));
      if (in.step > 0.0) levels[i].ledge = std::max(levels[i].ledge, -in.off(d));
    }
  }
  return levels;
}

}  // namespace imprint
