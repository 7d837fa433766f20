#include "simulation/coverage.h"

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

double total(const Coverage& coverage) { return cv::sum(coverage.share)[0]; }

double share_at(const Coverage& coverage, int x, int y) {
  return coverage.share.at<double>(y - coverage.region.y, x - coverage.region.x);
}

std::vector<ObservedPoint> rotated_rectangle(double cx, double cy, double width, double height, double angle) {
  std::vector<ObservedPoint> corners;
  for (const auto& [a, b] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}) {
    const double x = a * width, y = b * height;
    corners.push_back({cx + std::cos(angle) * x - std::sin(angle) * y, cy + std::sin(angle) * x + std::cos(angle) * y});
  }
  return corners;
}

}  // namespace

TEST_CASE("coverage: a pixel is the unit square around its whole-numbered centre") {
  const auto coverage = polygon_coverage({{2.5, 1.5}, {3.75, 1.5}, {3.75, 2.1}, {2.5, 2.1}}, {10, 10});
  CHECK(share_at(coverage, 3, 2) == Approx(0.6).margin(1e-14));
  CHECK(share_at(coverage, 4, 2) == Approx(0.25 * 0.6).margin(1e-14));
  CHECK(total(coverage) == Approx(1.25 * 0.6).margin(1e-14));
}

TEST_CASE("coverage: the shares of a turned rectangle add up to its area, in either sense of rotation") {
  for (const double angle : {0.0, 0.01, 0.4, 1.2, 2.9}) {
    auto corners = rotated_rectangle(50.3, 40.7, 61.0, 3.3, angle);
    CHECK(total(polygon_coverage(corners, {100, 100})) == Approx(61.0 * 3.3).margin(1e-10));  // double rounding
    std::reverse(corners.begin(), corners.end());
    CHECK(total(polygon_coverage(corners, {100, 100})) == Approx(61.0 * 3.3).margin(1e-10));
  }
}

TEST_CASE("coverage: each pixel under a slanted edge has the trapezium's area") {
  // The edge y = 5 + 0.3 x; the polygon lies below it. Pixel (x, y) is cut from height 5 + 0.3 (x - 0.5) on.
  const auto coverage = polygon_coverage({{-0.5, 4.85}, {19.5, 10.85}, {19.5, 19.5}, {-0.5, 19.5}}, {20, 20});
  for (int x = 0; x < 20; ++x) {
    double column = 0.0;
    for (int y = coverage.region.y; y < 20; ++y) column += share_at(coverage, x, y);
    CHECK(column == Approx(19.5 - (5.0 + 0.3 * x)).margin(1e-12));
  }
  CHECK(share_at(coverage, 1, 5) == Approx(5.5 - 5.3).margin(1e-12));  // the edge crosses this pixel from side to side
  CHECK(share_at(coverage, 10, 15) == 1.0);
}

TEST_CASE("coverage: what lies outside the image is cut off") {
  for (const double angle : {0.0, 0.7, 1.5}) {
    const auto around = rotated_rectangle(10.0, 10.0, 500.0, 400.0, angle);
    CHECK(total(polygon_coverage(around, {20, 20})) == Approx(400.0).margin(1e-9));
  }
  CHECK(total(polygon_coverage({{-30, -30}, {9.5, -30}, {9.5, 90}, {-30, 90}}, {20, 20})) ==
        Approx(200.0).margin(1e-10));
  CHECK(polygon_coverage({{-30, -30}, {-10, -30}, {-10, 5}}, {20, 20}).region.empty());
}

}  // namespace imprint
