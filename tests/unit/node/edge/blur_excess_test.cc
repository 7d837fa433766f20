#include "node/edge/blur_excess.h"

#include <cmath>
#include <numbers>
#include <random>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

constexpr int kCount = 13, kLines = 120, kHalfLines = 8;
constexpr double kBlur = 0.9, kOutside = 0.05, kStep = 0.3;

double smooth_step(double x, double blur) { return 0.5 * std::erfc(-x / blur / std::numbers::sqrt2); }

// What `profile` (line, distance inwards in px) gives, as fitted with the blur of the region.
template <typename Profile>
std::vector<double> excess_of(Profile profile, double noise) {
  std::mt19937 random(7);
  std::normal_distribution<double> gauss(0.0, 1.0);
  std::vector<std::vector<float>> values;
  std::vector<FittedLine> lines;
  for (int line = 0; line < kLines; ++line) {
    const double place = 6.0 + 0.4 * std::sin(0.13 * line);
    std::vector<float>& drawn = values.emplace_back();
    for (int i = 0; i < kCount; ++i)
      drawn.push_back(static_cast<float>(kOutside + kStep * (profile(line, i - place) + noise * gauss(random))));
    const auto fit = fit_step(drawn.data(), kCount, place + 0.1, {kBlur, 0.0});
    REQUIRE(fit);
    lines.push_back({line, drawn.data(), kCount, *fit, {kBlur, 0.0}});
  }
  return blur_excess(lines, kHalfLines);
}

TEST_CASE("an edge as sharp as its region has no excess of blur") {
  for (const double noise : {0.0, 0.02}) {
    const auto excess = excess_of([](int, double x) { return smooth_step(x, kBlur); }, noise);
    REQUIRE(excess.size() == kLines);
    for (const double value : excess) CHECK(std::abs(value) < (noise > 0.0 ? 0.1 : 0.01));
  }
}

TEST_CASE("a stretch of an edge that is wider is told by how much, and the rest is not") {
  const auto excess =
      excess_of([](int line, double x) { return smooth_step(x, line < kLines / 2 ? kBlur : 1.2 * kBlur); }, 0.01);
  for (int line = 0; line < kLines; ++line) {
    if (line < kLines / 2 - kHalfLines) CHECK(std::abs(excess[static_cast<std::size_t>(line)]) < 0.05);
    if (line >= kLines / 2 + kHalfLines)
      CHECK(excess[static_cast<std::size_t>(line)] == Approx(0.2).margin(0.06));  // first order
  }
}

TEST_CASE("a strip too thin to be seen as one widens the edge; a sharper edge is less wide") {
  const auto strip =
      excess_of([](int, double x) { return 0.35 * smooth_step(x + 2.0, kBlur) + 0.65 * smooth_step(x, kBlur); }, 0.01);
  for (const double value : strip) CHECK(value > 0.3);
  const auto sharp = excess_of([](int, double x) { return smooth_step(x, 0.85 * kBlur); }, 0.01);
  for (const double value : sharp) CHECK(value < -0.08);
}

TEST_CASE("no lines have no excess") { CHECK(blur_excess({}, kHalfLines).empty()); }

}  // namespace
}  // namespace imprint
