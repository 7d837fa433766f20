#include "fusion/combine/alignment.h"

#include <cmath>

#include <Eigen/Dense>
#include <catch2/catch.hpp>

namespace imprint {

TEST_CASE("alignment: the forging's z is the world's z made square to its axis, right-handed") {
  const Eigen::Matrix3d axes = forging_axes({2.0, 0.1, 0.3});
  CHECK((axes * axes.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-12);
  CHECK(axes.determinant() == Approx(1.0));
  CHECK(axes.row(0).dot(Eigen::Vector3d(2.0, 0.1, 0.3).normalized()) == Approx(1.0));
  CHECK(axes(2, 2) > 0.9);
  // Square to the plane of x and the world's z.
  CHECK(std::abs(axes.row(1).dot(Eigen::Vector3d::UnitZ())) < 1e-12);
}

TEST_CASE("alignment: an upright forging takes the world's y instead") {
  const Eigen::Matrix3d axes = forging_axes({0.05, 0.0, 1.0});
  CHECK(axes.determinant() == Approx(1.0));
  CHECK(axes(2, 1) > 0.99);
  // Eleven degrees off, the world's z still serves.
  const double angle = 11.0 * M_PI / 180.0;
  CHECK(forging_axes({std::sin(angle), 0.0, std::cos(angle)})(2, 2) > 0.1);
}

TEST_CASE("alignment: the ideal axis of a straight forging is that forging, whatever its sampling") {
  for (const int samples : {40, 500, 733}) {
    std::vector<double> x;
    std::vector<Eigen::Vector2d> yz;
    for (int i = 0; i < samples; ++i) {
      x.push_back(1900.0 * i / (samples - 1));
      yz.emplace_back(3.0 - 0.01 * x.back(), 0.02 * x.back());
    }
    const IdealAxis axis = ideal_axis(x, yz, 0.0, 1900.0, 80.0);
    CHECK(axis.slope.x() == Approx(-0.01).epsilon(1e-9));
    CHECK(axis.slope.y() == Approx(0.02).epsilon(1e-9));
    CHECK((axis.at(500.0).tail<2>() - Eigen::Vector2d(-2.0, 10.0)).norm() < 1e-9);
  }
}

TEST_CASE("alignment: only the two end sections define the ideal axis") {
  std::vector<double> x;
  std::vector<Eigen::Vector2d> yz;
  for (int i = 0; i < 500; ++i) {
    x.push_back(1900.0 * i / 499.0);
    const bool inside = x.back() > 90.0 && x.back() < 1810.0;
    yz.emplace_back(inside ? 50.0 : 0.0, 0.0);
  }
  const IdealAxis axis = ideal_axis(x, yz, 0.0, 1900.0, 80.0);
  CHECK(axis.mean_mm.norm() < 1e-9);
  CHECK(axis.slope.norm() < 1e-9);
}

TEST_CASE("alignment: a forging shorter than two end sections is taken whole") {
  std::vector<double> x;
  std::vector<Eigen::Vector2d> yz;
  for (int i = 0; i < 50; ++i) {
    x.push_back(2.0 * i);
    yz.emplace_back(1.0 + 0.1 * x.back(), 0.0);
  }
  const IdealAxis axis = ideal_axis(x, yz, 0.0, 98.0, 80.0);
  CHECK(axis.slope.x() == Approx(0.1).epsilon(1e-9));
}

}  // namespace imprint
