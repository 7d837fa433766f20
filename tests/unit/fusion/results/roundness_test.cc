#include "fusion/results/roundness.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

/// r = 130 + lobe cos(k theta), off the origin.
std::vector<Eigen::Vector2d> lobed(int k, double lobe_mm, const Eigen::Vector2d& center = {3.0, -2.0}) {
  std::vector<Eigen::Vector2d> profile;
  for (int i = 0; i < 360; ++i) {
    const double theta = i * M_PI / 180.0;
    profile.push_back(center +
                      (130.0 + lobe_mm * std::cos(k * theta)) * Eigen::Vector2d(std::cos(theta), std::sin(theta)));
  }
  return profile;
}

double ring(const std::vector<Eigen::Vector2d>& profile, const Eigen::Vector2d& center) {
  double nearest = 1e9, furthest = 0.0;
  for (const auto& point : profile) {
    nearest = std::min(nearest, (point - center).norm());
    furthest = std::max(furthest, (point - center).norm());
  }
  return furthest - nearest;
}

}  // namespace

TEST_CASE("roundness: lobes of 1 mm are 2 mm of roundness about whichever centre, wherever the section lies") {
  for (const int k : {2, 3, 5}) {
    const Roundness found = roundness(lobed(k, 1.0));
    CHECK(found.least_squares_mm == Approx(2.0).margin(1e-3));
    CHECK(found.minimum_zone_mm == Approx(2.0).margin(1e-3));
    CHECK(found.minimum_circumscribed_mm == Approx(2.0).margin(1e-3));
  }
}

TEST_CASE("roundness: a circle is round, off the origin too") {
  const Roundness found = roundness(lobed(2, 0.0, {40.0, 7.0}));
  CHECK(found.least_squares_mm < 1e-6);
  CHECK(found.minimum_zone_mm < 1e-6);
  CHECK(found.minimum_circumscribed_mm < 1e-6);
}

TEST_CASE("roundness: a flat of 2 mm is 2 mm about the smallest circle around it, less about the best centre") {
  std::vector<Eigen::Vector2d> profile = lobed(2, 0.0, {0.0, 0.0});
  for (auto& point : profile) point.x() = std::min(point.x(), 128.0);
  const Roundness found = roundness(profile);
  CHECK(found.minimum_circumscribed_mm == Approx(2.0).margin(0.02));  // the circle itself stays the smallest
  CHECK(found.minimum_zone_mm < found.least_squares_mm);
  CHECK(found.least_squares_mm < 2.0);
}

TEST_CASE("roundness: no centre of a fine grid has a narrower ring than the minimum zone") {
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 5; ++trial) {
    std::vector<Eigen::Vector2d> profile;
    double lobes[5][2];
    for (auto& lobe : lobes) lobe[0] = normal(generator), lobe[1] = normal(generator);
    for (int i = 0; i < 72; ++i) {
      const double theta = i * M_PI / 36.0;
      double r = 130.0;
      for (int k = 2; k <= 6; ++k) r += lobes[k - 2][0] * std::cos(k * theta) + lobes[k - 2][1] * std::sin(k * theta);
      profile.emplace_back(r * std::cos(theta), r * std::sin(theta));
    }
    double best = 1e9;
    for (double y = -4.0; y <= 4.0; y += 0.02)
      for (double z = -4.0; z <= 4.0; z += 0.02) best = std::min(best, ring(profile, {y, z}));
    const Roundness found = roundness(profile);
    CHECK(found.minimum_zone_mm < best + 1e-3);
    CHECK(found.minimum_zone_mm > best - 0.03);  // the grid's pitch, twice, in the ring's width
    CHECK(found.least_squares_mm >= found.minimum_zone_mm);
  }
}

}  // namespace imprint
