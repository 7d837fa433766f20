#include "node/edge/level_slopes.h"

#include <cmath>
#include <numbers>
#include <random>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

constexpr int kCount = 11;
constexpr double kBlur = 0.9, kOutside = 0.05, kStep = 0.3;

double blurred_ramp(double x) {
  const double z = x / kBlur;
  return kBlur *
         (0.5 * z * std::erfc(-z / std::numbers::sqrt2) + std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi));
}

// Lines across a rim whose levels change with the distance from it, in shares of the step per px; drawn from the edge's
// definition, not by what is tested.
struct Rim {
  double inside = 0.0, outside = 0.0, noise = 0.0;
  int lines = 200;

  [[nodiscard]] double place(int line) const { return 5.0 + 0.5 * std::sin(0.11 * line); }
  [[nodiscard]] std::vector<std::vector<float>> values() const {
    std::mt19937 random(5);
    std::normal_distribution<double> gauss(0.0, 1.0);
    std::vector<std::vector<float>> all;
    for (int line = 0; line < lines; ++line) {
      std::vector<float> values;
      for (int i = 0; i < kCount; ++i) {
        const double x = i - place(line);
        const double step = 0.5 * std::erfc(-x / kBlur / std::numbers::sqrt2);
        values.push_back(static_cast<float>(
            kOutside + kStep * (step + inside * blurred_ramp(x) + outside * blurred_ramp(-x)) + noise * gauss(random)));
      }
      all.push_back(values);
    }
    return all;
  }
};

struct Errors {
  double plain = 0.0, shifted = 0.0;  // root mean square
};

Errors errors_of(const Rim& rim) {
  const auto values = rim.values();
  std::vector<FittedLine> lines;
  for (int i = 0; i < rim.lines; ++i) {
    const float* const line = values[static_cast<std::size_t>(i)].data();
    const auto fit = fit_step(line, kCount, rim.place(i) + 0.2, {kBlur, 0.0});
    REQUIRE(fit);
    lines.push_back({i, line, kCount, *fit, {kBlur, 0.0}});
  }
  const std::vector<double> shifts = shifts_by_slopes(lines, 14);
  REQUIRE(shifts.size() == lines.size());
  Errors errors;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double error = lines[i].fit.position - rim.place(lines[i].index);
    errors.plain += error * error / rim.lines;
    errors.shifted += std::pow(error + shifts[i], 2) / rim.lines;
  }
  return {std::sqrt(errors.plain), std::sqrt(errors.shifted)};
}

}  // namespace

TEST_CASE("level slopes: what uneven levels pull away comes back") {
  for (const auto& [inside, outside] : {std::pair{0.04, 0.0}, {-0.04, 0.0}, {0.0, 0.03}, {0.03, -0.02}}) {
    const Errors errors = errors_of({inside, outside, 0.0});
    INFO("slopes " << inside << " and " << outside << ": " << errors.plain << " px, then " << errors.shifted);
    CHECK(errors.plain > 0.03);
    CHECK(errors.shifted < 0.15 * errors.plain);  // first order of the slopes
  }
}

TEST_CASE("level slopes: even levels cost little, noise or not") {
  CHECK(errors_of({0.0, 0.0, 0.0}).shifted < 1e-4);
  const Errors noisy = errors_of({0.0, 0.0, 0.01});
  CHECK(noisy.plain > 0.03);  // there is noise
  CHECK(noisy.shifted < 1.1 * noisy.plain);
}

TEST_CASE("level slopes: a spark on a few lines does not bend their neighbours") {
  const Rim rim{0.03, 0.0, 0.003};
  const auto shifts_of = [&](const std::vector<std::vector<float>>& values) {
    std::vector<FittedLine> lines;
    for (int i = 0; i < rim.lines; ++i) {
      const float* const line = values[static_cast<std::size_t>(i)].data();
      const auto fit = fit_step(line, kCount, rim.place(i), {kBlur, 0.0});
      REQUIRE(fit);
      lines.push_back({i, line, kCount, *fit, {kBlur, 0.0}});
    }
    return shifts_by_slopes(lines, 14);
  };
  auto values = rim.values();
  const std::vector<double> without = shifts_of(values);
  for (std::size_t line = 95; line < 99; ++line)
    for (std::size_t i = 8; i < kCount; ++i) values[line][i] += 0.05F * static_cast<float>(i - 7);
  const std::vector<double> with = shifts_of(values);
  double largest = 0.0;
  for (std::size_t i = 80; i < 115; ++i)
    if (i < 95 || i >= 99) largest = std::max(largest, std::abs(with[i] - without[i]));
  CHECK(largest < 0.01);  // of 0.04 px that the slope itself moves
}

}  // namespace imprint
