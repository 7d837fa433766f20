#include "tests/unit/fusion/comparison/laser_scan.h"

#include <cmath>

#include <catch2/catch.hpp>

namespace imprint::test {

TEST_CASE("laser scan: points on the side of a scanner are 2 mm off the rod, and none are under it") {
  const Rod rod;  // straight and round, radius 130 mm
  double squares = 0.0, count = 0.0;
  for (const Eigen::Vector3d& p : scanned(rod, {Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()}, {}, 3)) {
    CHECK(p.z() < 140.0);
    const double theta = std::atan2(p.z(), p.y());
    CHECK(std::abs(theta + 0.5 * M_PI) > 0.45);  // 31 degrees to either side of straight down, less the noise
    if (std::abs(theta - 0.093 * M_PI) > 0.1) continue;
    squares += std::pow(p.tail<2>().norm() - 130.0, 2), count += 1.0;
  }
  REQUIRE(count > 4000.0);                                       // 634 rings of 8 points, 3 mm apart
  CHECK(std::sqrt(squares / count) == Approx(2.0).margin(0.1));  // 4000 points tell it to 0.02
}

TEST_CASE("laser scan: a second scanner registered badly is off as a whole") {
  const Rod rod;
  const Lying at_origin{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  const auto exact = scanned(rod, at_origin, {.noise_mm = 0.0}, 4);
  const auto moved = scanned(rod, at_origin, {.noise_mm = 0.0, .registration_mm = 1.0}, 4);
  REQUIRE(exact.size() == moved.size());
  const Eigen::Vector3d off = moved.back() - exact.back();
  CHECK(off.norm() > 0.1);
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const Eigen::Vector3d by = moved[i] - exact[i];
    CHECK((by.norm() < 1e-9 || (by - off).norm() < 1e-9));
  }
}

}  // namespace imprint::test
