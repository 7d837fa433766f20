#include "node/imprint/rim_steps.h"

#include <algorithm>
#include <cmath>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

// Median offset of the samples in [from, to]; nothing when there are fewer than three.
std::optional<double> median_between(const RimCurve& rim, double from, double to) {
  std::vector<double> offsets;
  const SampleRange range = samples_near(rim, 0.5 * (from + to), 0.5 * (to - from));
  for (std::size_t i = range.first; i < range.last; ++i)
    if (rim[i].weight > 0) offsets.push_back(rim[i].offset_px);
  if (offsets.size() < 3) return std::nullopt;
  return median(offsets);
}

}  // namespace

double rim_noise_px(const RimCurve& rim) {
  std::vector<double> bends;
  for (std::size_t i = 1; i + 1 < rim.size(); ++i)
    if (rim[i + 1].station_px - rim[i - 1].station_px < 2.5)
      bends.push_back(std::abs(rim[i - 1].offset_px - 2 * rim[i].offset_px + rim[i + 1].offset_px));
  if (bends.size() < 5) return 0.1;
  return std::max(0.01, 1.4826 * median(bends) / std::sqrt(6.0));
}

void drop_spikes(RimCurve& rim) {
  constexpr double kHalfPx = 6;
  const double limit = std::max(1.0, 6 * rim_noise_px(rim));
  std::vector<double> deviation(rim.size(), 0.0);
  for (std::size_t i = 0; i < rim.size(); ++i) {
    // Against the better of both sides: a sample next to a step agrees with one of them.
    double least = 1e18;
    for (const double side : {-1.0, 0.0, 1.0})
      if (const auto level =
              median_between(rim, rim[i].station_px + (side - 1) * kHalfPx, rim[i].station_px + (side + 1) * kHalfPx))
        least = std::min(least, std::abs(rim[i].offset_px - *level));
    deviation[i] = least < 1e18 ? least : 0.0;
  }
  for (std::size_t i = 0; i < rim.size(); ++i)
    if (deviation[i] > limit) rim[i].weight = 0.0;
}

std::vector<double> find_cuts(const RimCurve& rim, double noise_px, const FilterConfig& config) {
  const double step = std::max(config.min_step_px, 5 * noise_px);
  const double kink = std::max(config.min_kink, 2.5 * noise_px / config.step_window);
  std::vector<double> change(rim.size(), 0.0);  // 1 where a step or a kink reaches its threshold
  for (std::size_t i = 1; i < rim.size(); ++i) {
    const double reach = 0.5 * config.step_window, between = 0.5 * (rim[i - 1].station_px + rim[i].station_px);
    // Next to a gap the sides are taken from its two ends.
    const SampleRange before = samples_near(rim, rim[i - 1].station_px - reach, reach);
    const SampleRange after = samples_near(rim, rim[i].station_px + reach, reach);
    const auto left = fit_parabola(rim.data() + before.first, rim.data() + before.last, between, 1);
    const auto right = fit_parabola(rim.data() + after.first, rim.data() + after.last, between, 1);
    if (!left || !right || before.last - before.first < 3 || after.last - after.first < 3) continue;
    change[i] = std::max(std::abs(right->c0 - left->c0) / step, std::abs(right->c1 - left->c1) / kink);
    if (rim[i].station_px - rim[i - 1].station_px > config.max_region_gap) change[i] = std::max(change[i], 1e6);
  }
  std::vector<double> cuts;
  for (std::size_t i = 1; i < rim.size(); ++i) {
    if (change[i] < 1) continue;
    const SampleRange near = samples_near(rim, rim[i].station_px, 3);
    bool highest = true;
    for (std::size_t k = near.first; k < near.last && highest; ++k)
      highest = change[k] < change[i] || k == i || (change[k] == change[i] && k > i);
    if (highest) cuts.push_back(0.5 * (rim[i - 1].station_px + rim[i].station_px));
  }
  return cuts;
}

}  // namespace imprint
