#include "tests/paper/multiview/coverage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <fmt/core.h>

#include "tests/paper/multiview/corruption.h"

namespace imprint::test {
namespace {

constexpr std::array<std::size_t, 4> kObservations{1, 3, 6, 11};

/// Of the forgings one by one: what is held, in percent.
struct Held {
  std::vector<double> axis, diameter, circularity, length;
  double axis_squares = 0.0, diameter_squares = 0.0, circularity_squares = 0.0;  ///< of errors in half widths
};

struct Spread {
  double mean = 0.0, sigma_of_mean = 0.0;
};
Spread spread_of(const std::vector<double>& values) {
  Spread spread;
  const auto count = static_cast<double>(values.size());
  for (const double value : values) spread.mean += value / count;
  double squares = 0.0;
  for (const double value : values) squares += std::pow(value - spread.mean, 2);
  spread.sigma_of_mean = values.size() > 1 ? std::sqrt(squares / (count - 1.0) / count) : 0.0;
  return spread;
}

void print_row(std::size_t observations, const Held& held, int forgings) {
  fmt::print("  {:>4} |", observations);
  const auto cell = [&](const std::vector<double>& values, double squares) {
    const Spread s = spread_of(values);
    fmt::print(" {:>6.1f} +- {:<4.1f} {:>6.2f}   {:<8} |", s.mean, s.sigma_of_mean, std::sqrt(squares / forgings),
               s.mean >= 93.0 && s.mean <= 97.0 ? "reached" : "MISSED");
  };
  cell(held.axis, held.axis_squares);
  cell(held.diameter, held.diameter_squares);
  cell(held.circularity, held.circularity_squares);
  fmt::print(" {:>6.0f}\n", spread_of(held.length).mean);
}

}  // namespace

Result<void> print_coverage(int forgings, unsigned seed, const OutOfRound& out_of_round) {
  std::array<Held, kObservations.size()> held;
  for (int i = 0; i < forgings; ++i) {
    const unsigned own = seed + static_cast<unsigned>(i);
    const Rod rod = forging(out_of_round, own);
    std::mt19937 generator(own + 500);
    const Session session =
        corrupted(observe(rod, {.observations = static_cast<int>(kObservations.back()), .seed = own}), {}, generator);
    const auto all = reconstruct(session);
    if (!all) return pass_on(all.error());
    for (std::size_t k = 0; k < kObservations.size(); ++k) {
      const auto d = measure(rod, session, *all, kObservations[k], Estimator::joint);
      if (!d) return pass_on(d.error());
      held[k].axis.push_back(100.0 * d->axis_covered);
      held[k].diameter.push_back(100.0 * d->diameter_covered);
      held[k].circularity.push_back(100.0 * d->circularity_covered);
      held[k].length.push_back(100.0 * d->length_in_ci);
      held[k].axis_squares += d->axis_in_ci;
      held[k].diameter_squares += d->diameter_in_ci;
      held[k].circularity_squares += d->circularity_in_ci;
    }
    fmt::print(stderr, "forging {} of {}\n", i + 1, forgings);
  }
  fmt::print(
      "95 % intervals of the joint estimate over the sections of {} forgings, seeds from {}: share that holds the "
      "truth in % (mean over the\nforgings and its standard deviation, goal 93 to 97), and RMS of the errors in "
      "half widths (0.51 of normal values, 0.58 in a plane)\n  {:>4} | {:^34} | {:^34} | {:^34} | {}\n",
      forgings, seed, "obs.", "axis", "diameter", "circularity", "length, %");
  for (std::size_t k = 0; k < kObservations.size(); ++k) print_row(kObservations[k], held[k], forgings);
  return {};
}

}  // namespace imprint::test
