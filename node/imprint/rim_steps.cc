#include "node/imprint/rim_steps.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Median offset of the samples in [from, to]; nothing when there are fewer than three.
std::optional<double> median_between(const RimCurve& rim, double from, double to) {
  std::vector<double> offsets;
  const SampleRange range = samples_near(rim, 0.5 * (from + to), 0.5 * (to - from));
  for (std::size_t i = range.first; i < range.last; ++i)
    if (rim[i].weight > 0) offsets.push_back(rim[i].offset_px);
  if (offsets.size() < 3) return std::nullopt;
  return median(offsets);
}

// How far the rim lies off the line between its own course just before and just after [from, to].
std::optional<double> displacement(const RimCurve& rim, double from, double to, double reach) {
  const auto before = median_between(rim, from - reach, from - 1), after = median_between(rim, to + 1, to + reach);
  const auto within = median_between(rim, from, to);
  if (!before || !after || !within) return std::nullopt;
  return *within - 0.5 * (*before + *after);
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
  const double threshold = std::max(config.min_step_px, 5 * noise_px);
  std::vector<double> jump(rim.size(), 0.0);
  for (std::size_t i = 1; i < rim.size(); ++i) {
    const double between = 0.5 * (rim[i - 1].station_px + rim[i].station_px);
    const double reach = 0.5 * config.step_window;
    // Next to a gap the sides are taken from its two ends.
    const SampleRange before = samples_near(rim, rim[i - 1].station_px - reach, reach),
                      after = samples_near(rim, rim[i].station_px + reach, reach);
    const auto left = fit_at_station(rim, before, between, 1), right = fit_at_station(rim, after, between, 1);
    if (left && right && before.last - before.first >= 3 && after.last - after.first >= 3)
      jump[i] = std::abs(*right - *left);
  }
  std::vector<double> cuts;
  for (std::size_t i = 1; i < rim.size(); ++i) {
    if (jump[i] < threshold) continue;
    const SampleRange near = samples_near(rim, rim[i].station_px, 3);
    bool highest = true;
    for (std::size_t k = near.first; k < near.last && highest; ++k)
      highest = jump[k] < jump[i] || k == i || (jump[k] == jump[i] && k > i);
    if (highest) cuts.push_back(0.5 * (rim[i - 1].station_px + rim[i].station_px));
  }
  return cuts;
}

void reject_patches(RimCurve& rim, const std::vector<double>& cuts, const RimCurve& other, const FilterConfig& config) {
  constexpr double kReachPx = 12;
  for (std::size_t a = 0; a < cuts.size(); ++a) {
    for (std::size_t b = a + 1; b < cuts.size() && cuts[b] - cuts[a] <= config.max_patch_length; ++b) {
      const double from = cuts[a], to = cuts[b];
      const auto before = median_between(rim, from - kReachPx, from - 0.5),
                 after = median_between(rim, to + 0.5, to + kReachPx);
      const auto moved = displacement(rim, from, to, kReachPx);
      if (!moved || std::abs(*moved) < config.min_step_px) continue;
      // A return to the old line makes a patch; a stair does not.
      if (std::abs(*after - *before) > std::max(1.5, 0.4 * std::abs(*moved))) continue;
      const auto mirrored = displacement(other, from, to, kReachPx);
      if (mirrored && -*mirrored * *moved > 0.4 * *moved * *moved)
        continue;  // both rims move in or out: a collar or a groove
      const SampleRange range = samples_near(rim, 0.5 * (from + to), 0.5 * (to - from));
      for (std::size_t i = range.first; i < range.last; ++i) rim[i].weight = 0.0;
    }
  }
}

}  // namespace imprint
