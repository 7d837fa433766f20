#include "fusion/comparison/comparison.h"

#include <cmath>
#include <random>

#include <catch2/catch.hpp>

#include "lib/geometry/rotation.h"
#include "tests/unit/fusion/comparison/laser_scan.h"
#include "tests/unit/fusion/triangulate/forging_sessions.h"

namespace imprint::test {
namespace {

/// The rod as a measurement that is wrong by nothing, with the intervals given.
Measurement perfect(const Rod& rod, double axis_ci95_mm, double diameter_ci95_mm) {
  const AlignedRod aligned(rod, 80.0);
  Measurement m;
  m.length_mm = rod.length_mm;
  for (int i = 0; i < 500; ++i) {
    const double s = rod.length_mm * i / 499.0;
    const Eigen::Vector2d yz = aligned.axis(s);
    m.sections.push_back({s,
                          {s, yz.x(), yz.y()},
                          yz.norm(),
                          aligned.diameter(s),
                          aligned.circularity(s),
                          axis_ci95_mm,
                          diameter_ci95_mm,
                          0.5});
  }
  return m;
}

std::vector<Eigen::Vector3d> scan(const Rod& rod, const Eigen::Matrix3d& R, const Eigen::Vector3d& origin_mm,
                                  unsigned seed) {
  return scanned(rod, {R, origin_mm}, {}, seed);
}

Rod forging() {
  Rod rod = stepped_rod();
  make_out_of_round(rod, 3.0, 250.0, 17);
  return rod;
}

}  // namespace

TEST_CASE("compare: a scan in another frame is registered, and agrees with a result that is right") {
  const Rod rod = forging();
  const Eigen::Matrix3d R = rotation_from_vector({0.9, -0.6, 1.9});
  const auto found = compare(perfect(rod, 0.3, 0.4), scan(rod, R, {5000.0, -300.0, 120.0}, 1), {});
  INFO((found ? std::string() : found.error().message));
  REQUIRE(found);
  INFO(to_json(*found)["diameter"].dump() << to_json(*found)["axis"].dump() << to_json(*found)["registration"].dump());
  CHECK(found->sections > 480);
  // A slice holds some 500 points of 2 mm: 0.1 mm of centre, 0.2 of diameter; the shoulders' slices are blurred.
  CHECK(std::abs(found->axis.median_mm) < 0.1);
  CHECK(std::abs(found->diameter.median_mm) < 0.2);
  CHECK(std::abs(found->circularity.median_mm) < 0.3);
  CHECK(found->axis.overlap > 0.95);
  CHECK(found->diameter.overlap > 0.85);
}

TEST_CASE("compare: a scan that lies the other way round is turned") {
  const Rod rod = forging();
  const Eigen::Matrix3d R = rotation_from_vector({0.0, M_PI, 0.0});
  const auto found = compare(perfect(rod, 0.3, 0.4), scan(rod, R, Eigen::Vector3d::Zero(), 2), {});
  REQUIRE(found);
  CHECK(found->axis.overlap > 0.95);
  CHECK(std::abs(found->diameter.median_mm) < 0.2);
}

TEST_CASE("compare: a result 2 mm too thick and bent 2 mm too far is told, in size and in overlap") {
  const Rod rod = forging();
  Measurement wrong = perfect(rod, 0.2, 0.2);
  for (auto& section : wrong.sections) {
    section.diameter_mm += 2.0;
    for (int k = 1; k < 3; ++k) section.axis_mm[k] *= 1.25;  // of 8 mm
    section.deflection_mm *= 1.25;
  }
  const auto found = compare(wrong, scan(rod, rotation_from_vector({0.3, 0.0, 0.4}), Eigen::Vector3d::Zero(), 3), {});
  REQUIRE(found);
  CHECK(found->diameter.median_mm == Approx(2.0).margin(0.2));
  CHECK(found->diameter.overlap < 0.3);
  CHECK(found->axis.mean_mm > 0.8);
  CHECK(found->axis.overlap < 0.5);
}

TEST_CASE("compare: in the same frame nothing is turned, and strays do no harm") {
  const Rod rod = forging();
  Measurement m = perfect(rod, 0.3, 0.4);
  m.R_forging_world = rotation_from_vector({0.0, 0.1, 0.2});
  m.origin_world_mm = {100.0, 200.0, 300.0};
  // The forging's frame is that of its ideal axis, the rod's own is not.
  const AlignedRod aligned(rod, 80.0);
  auto cloud = scan(rod, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), 4);
  const Eigen::Vector2d at_first = rod.axis(0.0) - aligned.axis(0.0);
  const Eigen::Vector2d at_last = rod.axis(rod.length_mm) - aligned.axis(rod.length_mm);
  for (auto& p : cloud) {
    p.tail<2>() -= at_first + (at_last - at_first) * p.x() / rod.length_mm;
    p = (m.R_forging_world.transpose() * p + m.origin_world_mm).eval();
  }
  for (int i = 0; i < 20; ++i) cloud.emplace_back(-4000.0 + 300.0 * i, 3000.0, 50.0 * i);
  const auto found = compare(m, cloud, {.same_frame = true});
  INFO((found ? std::string() : found.error().message));
  REQUIRE(found);
  CHECK(found->turn_deg == 0.0);
  CHECK(found->axis.overlap > 0.95);
  CHECK(std::abs(found->diameter.median_mm) < 0.2);
}

TEST_CASE("compare: a cloud that is no rod, or too small, is an error with the reason") {
  const Measurement m = perfect(forging(), 0.3, 0.4);
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform(0.0, 1000.0);
  std::vector<Eigen::Vector3d> plane;
  for (int i = 0; i < 20000; ++i) plane.emplace_back(uniform(generator), uniform(generator), 0.0);
  const auto found = compare(m, plane, {});
  REQUIRE_FALSE(found);
  CHECK(found.error().message.find("cross-sections") != std::string::npos);
  CHECK_FALSE(compare(m, {}, {}));
}

}  // namespace imprint::test
