#include "node/pose/hot_air.h"

#include <cmath>
#include <random>

#include <catch2/catch.hpp>

#include "node/resect/resect.h"

using namespace imprint;

namespace {

// A silhouette 100 px wide along the row 500, from column 200 to 800.
Segmentation band() {
  Segmentation forging;
  forging.origin = {0.0, 500.0};
  forging.first_station_px = 200;
  forging.upper_offset_px.assign(601, -50.0F);
  forging.lower_offset_px.assign(601, 50.0F);
  return forging;
}

DetectedTarget target_at(double x_px, double y_px) { return {1, {x_px, y_px}, 0.02, 20.0, 0.0}; }

}  // namespace

TEST_CASE("hot air: beside the forging a target's sigma is the air's, one diameter off a third of it") {
  const HotAirConfig config;
  const auto weighed = weigh_hot_air(
      {target_at(500, 550), target_at(500, 650), target_at(900, 500), target_at(500, 5000)}, band(), config);
  const auto air = [&](std::size_t i) { return std::sqrt(weighed[i].sigma_px * weighed[i].sigma_px - 0.02 * 0.02); };
  CHECK(air(0) == Approx(config.sigma_px));
  CHECK(air(1) == Approx(config.sigma_px / std::exp(1.0)));
  CHECK(air(2) == Approx(config.sigma_px / std::exp(1.0)));  // beyond the end as beside the rim
  CHECK(weighed[3].sigma_px == Approx(0.02));
}

TEST_CASE("hot air: rims that were nowhere seen change nothing") {
  Segmentation forging = band();
  forging.upper_offset_px.assign(601, std::nanf(""));
  CHECK(weigh_hot_air({target_at(500, 550)}, forging, HotAirConfig{})[0].sigma_px == 0.02);
}

TEST_CASE("hot air: where it moves the targets beside the forging, the weights make the pose better") {
  double plain = 0.0, weighed = 0.0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    std::mt19937 random(seed);
    CameraModel camera;
    camera.id = "cam1";
    camera.width_px = 1000;
    camera.height_px = 1000;
    camera.focal_length_px = 1200.0;
    camera.principal_point = {499.5, 499.5};
    CameraPose truth;
    TargetField field;
    std::vector<DetectedTarget> targets;
    std::uniform_real_distribution<double> place(-0.38, 0.38), depth(8000, 11000);
    std::normal_distribution<double> normal(0.0, 1.0);
    for (int id = 1; id <= 20; ++id) {
      const double z = depth(random);
      const Eigen::Vector3d p(place(random) * z, place(random) * z, z);
      field.targets[id].p_world_mm = p;
      ObservedPoint at = project(camera, p);
      // Stronger and wider than the weights take it to be, and everywhere a little.
      const double air_px = 0.05 + 0.25 * std::exp(-std::abs(at.y_px - 500.0) / 150.0);
      at.x_px += std::hypot(0.02, air_px) * normal(random);
      at.y_px += std::hypot(0.02, air_px) * normal(random);
      targets.push_back({id, at, 0.02, 20.0, 0.0});
    }
    const auto first = resect(camera, targets, field, ResectConfig{});
    const auto second = resect(camera, weigh_hot_air(targets, band(), HotAirConfig{}), field, ResectConfig{});
    REQUIRE(first);
    REQUIRE(second);
    plain += first->pose.center_world_mm.squaredNorm();
    weighed += second->pose.center_world_mm.squaredNorm();
  }
  CHECK(weighed < 0.95 * plain);  // 0.76 over 250 fields
}
