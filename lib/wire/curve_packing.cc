#include "lib/wire/curve_packing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "lib/wire/bit_packing.h"

namespace imprint {
namespace {

constexpr std::uint32_t kPacking = 1;
constexpr std::uint32_t kMaxWeightLevels = 65535;

bool is_offset(double offset_px) { return std::abs(offset_px) <= kMaxOffsetPx; }  // false for NaN

std::vector<std::int32_t> weight_steps(const ImprintCurve& curve, int levels) {
  std::vector<std::int32_t> steps;
  for (std::size_t i = 0; i < curve.offset_px.size(); ++i) {
    const double weight = curve.weight[i];
    const bool trusted = weight > 0.0 && is_offset(curve.offset_px[i]);
    const double step = std::round(std::min(weight, 1.0) * levels);
    steps.push_back(trusted ? std::max(1, static_cast<int>(step)) : 0);
  }
  return steps;
}

/// Replaces the offsets that are not kept by the line between the nearest kept ones, constant beyond the outermost.
void interpolate(std::vector<double>& offset_px, const std::vector<bool>& kept) {
  const std::size_t n = offset_px.size();
  std::size_t left = n;  // last kept one before i
  for (std::size_t i = 0; i < n; ++i) {
    if (kept[i]) {
      left = i;
      continue;
    }
    std::size_t right = i;
    while (right < n && !kept[right]) ++right;
    for (; i < right; ++i) {
      if (left == n && right == n)
        offset_px[i] = 0.0;
      else if (left == n)
        offset_px[i] = offset_px[right];
      else if (right == n)
        offset_px[i] = offset_px[left];
      else
        offset_px[i] = std::lerp(offset_px[left], offset_px[right],
                                 static_cast<double>(i - left) / static_cast<double>(right - left));
    }
    --i;
  }
}

std::vector<double> carried_offsets(const ImprintCurve& curve, const std::vector<std::int32_t>& weights,
                                    bool interpolate_untrusted) {
  std::vector<double> offset_px = curve.offset_px;
  const bool any_trusted = std::any_of(weights.begin(), weights.end(), [](auto w) { return w > 0; });
  std::vector<bool> kept(offset_px.size());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const bool wanted = !interpolate_untrusted || weights[i] > 0 || (!any_trusted && i == 0);
    kept[i] = wanted && is_offset(offset_px[i]);
  }
  interpolate(offset_px, kept);
  return offset_px;
}

}  // namespace

CurveEconomy curve_economy(int n) {
  constexpr std::array kLevels = {255, 255, 127, 63, 31, 15, 7, 3, 1};
  const int last = static_cast<int>(kLevels.size()) - 1;
  CurveEconomy economy;
  economy.interpolate_untrusted = n > 0;
  economy.weight_levels = kLevels[static_cast<std::size_t>(std::min(n, last))];
  economy.offset_step_px = std::ldexp(economy.offset_step_px, std::max(0, n - last));
  return economy;
}

v1::Curve pack_curve(const ImprintCurve& curve, const CurveEconomy& economy) {
  v1::Curve packed;
  packed.set_packing(kPacking);
  packed.set_stations(static_cast<std::uint32_t>(curve.offset_px.size()));
  const auto weights = weight_steps(curve, economy.weight_levels);
  std::vector<std::int32_t> steps;
  for (const double offset_px : carried_offsets(curve, weights, economy.interpolate_untrusted))
    steps.push_back(static_cast<std::int32_t>(std::llround(offset_px / economy.offset_step_px)));
  // The middle of the range keeps residuals small for values without any order.
  const auto [lowest, highest] = std::minmax_element(steps.begin(), steps.end());
  const std::int32_t base = steps.empty() ? 0 : *lowest + (*highest - *lowest) / 2;
  packed.set_offset_step_px(economy.offset_step_px);
  packed.set_offset_base(base);
  packed.set_offsets(pack_values(steps, base));
  packed.set_weight_levels(static_cast<std::uint32_t>(economy.weight_levels));
  packed.set_weights(pack_values(weights, economy.weight_levels / 2));
  return packed;
}

Result<ImprintCurve> unpack_curve(const v1::Curve& packed) {
  ImprintCurve curve;
  const std::size_t stations = packed.stations();
  if (stations == 0) return curve;
  if (packed.packing() != kPacking)
    return invalid_input("expected packing {}, found {}: written by a newer program", kPacking, packed.packing());
  if (stations > kImprintStations)
    return invalid_input("expected at most {} stations, found {}", kImprintStations, stations);
  const double step_px = packed.offset_step_px();
  if (!(step_px > 0.0 && step_px <= kMaxOffsetPx))
    return invalid_input("expected a positive offset step, found {} px", step_px);
  const std::uint32_t levels = packed.weight_levels();
  if (levels == 0 || levels > kMaxWeightLevels)
    return invalid_input("expected 1 to {} weight levels, found {}", kMaxWeightLevels, levels);

  const auto steps = unpack_values(packed.offsets(), stations, packed.offset_base());
  if (!steps) return invalid_input("offsets: {}", steps.error().message);
  const auto weights = unpack_values(packed.weights(), stations, static_cast<std::int32_t>(levels / 2));
  if (!weights) return invalid_input("weights: {}", weights.error().message);
  for (std::size_t i = 0; i < stations; ++i) {
    const double offset_px = (*steps)[i] * step_px;
    // A step may round a point on the limit outwards.
    if (std::abs(offset_px) > kMaxOffsetPx + step_px)
      return invalid_input("offset {}: expected within {} px, found {} px", i, kMaxOffsetPx, offset_px);
    if ((*weights)[i] < 0 || static_cast<std::uint32_t>((*weights)[i]) > levels)
      return invalid_input("weight {}: expected 0 to {}, found {}", i, levels, (*weights)[i]);
    curve.offset_px.push_back(offset_px);
    curve.weight.push_back(static_cast<double>((*weights)[i]) / levels);
  }
  return curve;
}

}  // namespace imprint
