#include "node/detect/ring_correlator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "lib/targets/code_distance.h"

namespace imprint {
namespace {

constexpr int profile_columns_per_bit = 4;

/// A closed row of values, each the mean of `factor` columns; mean 0, norm 1. `norm`: what the norm was.
std::vector<double> normalized(const std::vector<double>& columns, int factor, double* norm) {
  std::vector<double> values(columns.size() / static_cast<std::size_t>(factor), 0.0);
  for (std::size_t i = 0; i < columns.size(); ++i) values[i / static_cast<std::size_t>(factor)] += columns[i] / factor;
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  double squares = 0.0;
  for (double& value : values) {
    value -= mean;
    squares += value * value;
  }
  *norm = std::sqrt(squares);
  for (double& value : values) value /= std::max(*norm, 1e-9);
  return values;
}

/// The code's profile along the ring under a blur of `sigma` bits, columns_per_bit values a bit.
std::vector<double> blurred_profile(std::uint32_t code, int bits, double sigma) {
  std::vector<double> columns;
  for (int i = 0; i < bits * columns_per_bit; ++i) {
    const double at = (i + 0.5) / columns_per_bit;
    double value = 0.0;
    for (int bit = -2; bit <= 2; ++bit) {  // bits farther off give less than 0.3 % at the largest sigma
      const int index = static_cast<int>(at) + bit;
      if (bit_at(code, bits, index) == 0) continue;
      const double from = (index - at) / sigma;
      value += 0.5 * (std::erfc(-(from + 1.0 / sigma) / std::numbers::sqrt2) - std::erfc(-from / std::numbers::sqrt2));
    }
    columns.push_back(value);
  }
  return columns;
}

}  // namespace

RingCorrelator::RingCorrelator(const TargetLibrary& library) : codes_(library.codes) {
  for (std::size_t i = 0; i < codes_.size(); ++i) {
    for (const double sigma : {0.2, 0.35, 0.5, 0.65}) {
      Profile profile{i, {}, 0.0};
      profile.columns = normalized(blurred_profile(codes_[i].code, library.bits, sigma),
                                   columns_per_bit / profile_columns_per_bit, &profile.light);
      profiles_.push_back(std::move(profile));
    }
  }
}

RingCorrelator::Correlated RingCorrelator::correlate(const RingScan& scan) const {
  Correlated result;
  if (std::any_of(scan.columns.begin(), scan.columns.end(), [](double v) { return std::isnan(v); })) return result;
  constexpr int factor = columns_per_bit / profile_columns_per_bit;
  double norm = 0.0;
  const std::vector<double> seen = normalized(scan.columns, factor, &norm);
  const std::size_t n = seen.size();
  std::vector<double> best_of_id(codes_.size(), -1.0);
  double best = -1.0;
  std::size_t best_code = 0;
  for (const Profile& profile : profiles_) {
    for (std::size_t turn = 0; turn < n; ++turn) {
      double sum = 0.0;
      for (std::size_t i = 0; i < n - turn; ++i) sum += profile.columns[i] * seen[i + turn];
      for (std::size_t i = n - turn; i < n; ++i) sum += profile.columns[i] * seen[i + turn - n];
      best_of_id[profile.code] = std::max(best_of_id[profile.code], sum);
      if (sum <= best) continue;
      best = sum;
      best_code = profile.code;
      result.turn = static_cast<int>(turn) * factor;
      result.light = norm / profile.light;
    }
  }
  best_of_id[best_code] = -1.0;
  const double second = *std::max_element(best_of_id.begin(), best_of_id.end());
  const double left = 1.0 - best * best;
  constexpr double most_left = 0.08;        // share of the columns' variance
  constexpr double least_advantage = 0.05;  // more left by the next id
  constexpr double least_light = 0.25;
  constexpr double most_light = 1.5;
  DecodedRing& ring = result.ring;
  ring.id = codes_[best_code].id;
  ring.code = codes_[best_code].code;
  ring.fit = std::sqrt(left / 4.0);  // about the rms in bits' light: half the bits are white
  ring.profile = ring.fit;
  ring.margin = (1.0 - second * second - left) / least_advantage;
  ring.lead = std::numeric_limits<double>::infinity();  // its margin is not in nats
  ring.accepted = left < most_left && ring.margin > 1.0 && result.light > least_light && result.light < most_light;
  return result;
}

}  // namespace imprint
