#include "node/segment/body_rims.h"

#include <algorithm>
#include <cmath>

#include "node/segment/body_extent.h"

namespace imprint {
namespace {

constexpr float kSame = 0.38F;     // of the contrast: as much off the body's level speaks neither for it nor against
constexpr float kDark = 0.6F;      // a pixel of scale against one of clean steel
constexpr float kBright = 1.5F;    // steel has no brighter pixels, but for sparks
constexpr float kEdge = 0.06F;     // worth of an edge, of the width
constexpr float kColumn = 0.3F;    // most that one column decides, of the width
constexpr float kPerPx = 0.1F;     // of moving the rim by a pixel, of the width
constexpr float kIgnored = 0.25F;  // of a jump: as many columns as this, of the width
constexpr float kLopsided = 2.0F;  // of leaving the distance that suits both rims, in pixels

using Ratings = std::vector<std::vector<float>>;

// How well each distance from the axis suits as the rim of one column, 0 at best.
void rate_column(const WorkingImage& working, int x, double axis_y, int step, float body, float contrast,
                 const std::vector<RimCandidate>& edges, float width, std::vector<float>& rating) {
  const int n = static_cast<int>(rating.size());
  const int from = static_cast<int>(std::lround(axis_y));
  float sum = 0;
  int seen = 0;
  for (int k = 0; k < n; ++k) {
    const int y = from + step * k;
    rating[static_cast<std::size_t>(k)] = sum;
    if (y < 0 || y >= working.intensity.rows || !working.valid(y, x)) continue;
    const float off = (working.intensity(y, x) - body) / (kSame * contrast);
    sum += std::max(1.0F - off * off, off > 0 ? -kBright : -kDark);
    ++seen;
  }
  if (seen == 0) {
    std::fill(rating.begin(), rating.end(), 0.0F);
    return;
  }
  for (const RimCandidate& edge : edges) {
    const double k = step * (edge.y_px - axis_y) + 0.5;  // the first pixel behind the edge
    const int at = static_cast<int>(std::lround(k));
    if (at >= 0 && at < n) rating[static_cast<std::size_t>(at)] += std::max(3.0F, kEdge * width) * edge.strength;
  }
  const float best = *std::max_element(rating.begin(), rating.end());
  for (float& r : rating) r = std::max(r - best, -kColumn * width);
}

// The best rim along all columns: a move costs by its length, at most `jump` (Viterbi with a truncated linear cost).
std::vector<float> best_line(const Ratings& ratings, int least, float per_px, float jump) {
  const std::size_t n = ratings.front().size();
  std::vector<float> gain(n, 0.0F), moved(n);
  std::vector<std::vector<short>> from(ratings.size(), std::vector<short>(n));
  for (std::size_t x = 0; x < ratings.size(); ++x) {
    auto& source = from[x];
    const auto top = static_cast<std::size_t>(std::max_element(gain.begin(), gain.end()) - gain.begin());
    moved = gain;
    for (std::size_t k = 0; k < n; ++k) source[k] = static_cast<short>(k);
    const auto offer = [&](std::size_t k, std::size_t beside) {
      if (moved[beside] - per_px > moved[k]) moved[k] = moved[beside] - per_px, source[k] = source[beside];
    };
    for (std::size_t k = 1; k < n; ++k) offer(k, k - 1);
    for (std::size_t k = n - 1; k > 0; --k) offer(k - 1, k);
    for (std::size_t k = 0; k < n; ++k) {
      if (gain[top] - jump > moved[k]) moved[k] = gain[top] - jump, source[k] = static_cast<short>(top);
      gain[k] = moved[k] + (static_cast<int>(k) < least ? -jump : ratings[x][k]);
    }
  }
  std::vector<float> line(ratings.size());
  auto k = static_cast<std::size_t>(std::max_element(gain.begin(), gain.end()) - gain.begin());
  for (std::size_t x = ratings.size(); x-- > 0;) {
    line[x] = static_cast<float>(k) - 0.5F;
    k = static_cast<std::size_t>(from[x][k]);
  }
  return line;
}

}  // namespace

BodyPath trace_rims(const WorkingImage& working, const AxisLine& line, const BodyLevels& levels,
                    const RimCandidates& rims, double width_px, double half_min_px, double half_max_px) {
  BodyPath path;
  if (levels.last_x_px < levels.first_x_px) return path;
  const auto [first_x_px, last_x_px] = extent_of_body(working, line, levels, rims, width_px, half_min_px, half_max_px);
  if (last_x_px < first_x_px) return path;
  const auto columns = static_cast<std::size_t>(last_x_px - first_x_px + 1);
  // Behind where its brightness ended it goes on as bright as there.
  const auto body_at = [&](int x) {
    return levels.body[static_cast<std::size_t>(std::clamp(x, levels.first_x_px, levels.last_x_px))];
  };
  const auto reach = static_cast<std::size_t>(std::max(4.0, half_max_px + 1));
  const auto width = static_cast<float>(std::max(8.0, width_px));
  const float jump = kColumn * width * std::max(4.0F, kIgnored * width);
  const float per_px = kPerPx * width;
  const int least = static_cast<int>(half_min_px);
  Ratings sides[2] = {Ratings(columns, std::vector<float>(reach)), Ratings(columns, std::vector<float>(reach))};
  Ratings both = sides[0];
  for (std::size_t i = 0; i < columns; ++i) {
    const int x = first_x_px + static_cast<int>(i);
    const auto column = static_cast<std::size_t>(x);
    const float body = body_at(x), contrast = std::max(1e-4F, body - levels.ground[column]);
    rate_column(working, x, line.y_px(x), -1, body, contrast, rims.upper[column], width, sides[0][i]);
    rate_column(working, x, line.y_px(x), 1, body, contrast, rims.lower[column], width, sides[1][i]);
    for (std::size_t k = 0; k < reach; ++k) both[i][k] = sides[0][i][k] + sides[1][i][k];
  }
  // A forging is round: first the distance that suits both rims, then each rim near it.
  const std::vector<float> half = best_line(both, least, 2 * per_px, 2 * jump);
  std::vector<float> rim[2];
  for (const int side : {0, 1}) {
    for (std::size_t i = 0; i < columns; ++i)
      for (std::size_t k = 0; k < reach; ++k)
        sides[side][i][k] -=
            kLopsided * std::max(0.0F, std::abs(static_cast<float>(k) - 0.5F - half[i]) - 0.05F * width);
    rim[side] = best_line(sides[side], least, per_px, jump);
  }
  for (std::size_t i = 0; i < columns; ++i) {
    const int x = first_x_px + static_cast<int>(i);
    const auto axis_y = static_cast<float>(line.y_px(x));
    RimPair pair;
    pair.upper_px = axis_y - rim[0][i], pair.lower_px = axis_y + rim[1][i];
    pair.body = body_at(x);
    // At the least distance nothing spoke for any other: no rim was found.
    const bool found = pair.width_px() > 2.0F * static_cast<float>(least + 1);
    pair.weight = found ? 1.0F : 0.0F;
    path.columns.push_back({x, pair});
  }
  return path;
}

}  // namespace imprint
