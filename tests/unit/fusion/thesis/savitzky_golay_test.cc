#include "fusion/thesis/savitzky_golay.h"

#include <random>

#include <catch2/catch.hpp>

namespace imprint {

TEST_CASE("savitzky_golay: a parabola stays as it is, ends included") {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 100; ++i) points.emplace_back(i, 0.01 * i * i - 3.0, 5.0 - 0.2 * i);
  const auto smooth = savitzky_golay(points, 41);
  for (std::size_t i = 0; i < points.size(); ++i) CHECK((smooth[i] - points[i]).norm() < 1e-8);
}

TEST_CASE("savitzky_golay: of white noise the filter's own share is left") {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 4000; ++i) points.emplace_back(i, normal(generator), 0.0);
  double squares = 0.0;
  const auto smooth = savitzky_golay(points, 41);
  for (std::size_t i = 40; i + 40 < smooth.size(); ++i) squares += smooth[i].y() * smooth[i].y() / 3920.0;
  // Variance of the middle of a parabola over 2 m + 1 points: (9 m^2 + 9 m - 3) / ((2 m + 3)(4 m^2 - 1)); 0.054.
  CHECK(squares == Approx(3777.0 / (43.0 * 1599.0)).epsilon(0.2));
}

TEST_CASE("savitzky_golay: fewer points than a parabola needs stay as they are") {
  const std::vector<Eigen::Vector3d> two{{0.0, 1.0, 2.0}, {1.0, 5.0, 2.0}};
  CHECK(savitzky_golay(two, 11) == two);
  CHECK(savitzky_golay({}, 11).empty());
}

}  // namespace imprint
