#include "fusion/results/straightness.h"

#include <cmath>
#include <vector>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

struct Axis {
  std::vector<double> s;
  std::vector<Eigen::Vector2d> yz;
};

Axis sampled(double length_mm, const auto& yz) {
  Axis axis;
  for (int i = 0; i < 500; ++i) {
    const double s = length_mm * i / 499.0;
    axis.s.push_back(s);
    axis.yz.push_back(yz(s));
  }
  return axis;
}

}  // namespace

TEST_CASE("straightness: a straight axis has a minimum zone of nothing, whichever way it leans") {
  const Axis axis = sampled(1900.0, [](double s) { return Eigen::Vector2d(0.01 * s - 4.0, 3.0 - 0.004 * s); });
  CHECK(minimum_zone_mm(axis.s, axis.yz) < 1e-6);
  CHECK(bow_over_mm(axis.s, axis.yz, 1000.0) < 1e-9);
}

TEST_CASE("straightness: an arc with 8 mm of sagitta lies in a cylinder of 8 mm, leaning or not") {
  const auto arc = [](double s) { return Eigen::Vector2d(32.0 * (s / 1900.0) * (1.0 - s / 1900.0), 0.02 * s); };
  const Axis axis = sampled(1900.0, arc);
  CHECK(minimum_zone_mm(axis.s, axis.yz) == Approx(8.0).epsilon(2e-3));
  // Over 1 m of its 1.9: a parabola's sagitta goes with the square of the length.
  CHECK(bow_over_mm(axis.s, axis.yz, 1000.0) == Approx(8.0 * std::pow(1000.0 / 1900.0, 2)).epsilon(0.02));
  CHECK(bow_over_mm(axis.s, axis.yz, 5000.0) == Approx(8.0).epsilon(1e-3));
}

TEST_CASE("straightness: a helix lies in the cylinder it winds round") {
  const Axis axis = sampled(1900.0, [](double s) {
    const double turn = 6.0 * M_PI * s / 1900.0;
    return Eigen::Vector2d(3.0 * std::cos(turn), 3.0 * std::sin(turn));
  });
  CHECK(minimum_zone_mm(axis.s, axis.yz) == Approx(6.0).epsilon(3e-3));
}

}  // namespace imprint
