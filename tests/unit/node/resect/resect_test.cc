#include "node/resect/resect.h"

#include <random>

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "tests/unit/paper_camera.h"

using namespace imprint;
using Catch::Matchers::Contains;

namespace {

// A camera and a field as in [B]: 6 x 6 x 2 m seen from about 9 m.
struct Setup {
  CameraModel camera;
  CameraPose pose;
  TargetField field;

  explicit Setup(int targets, unsigned seed = 1) {
    camera = paper_camera();
    pose.R_cam_world = rotation_from_omega_phi_kappa({3.83, 0.014, 3.07}).transpose();
    pose.center_world_mm = {-553.64, -5503.11, 6996.44};
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> x(-0.38, 0.38), y(-0.28, 0.28), depth(7500, 10500);
    for (int id = 1; id <= targets; ++id) {
      const double z = depth(random);
      const Eigen::Vector3d p_cam(x(random) * z, y(random) * z, z);
      field.targets[id].p_world_mm = pose.R_cam_world.transpose() * p_cam + pose.center_world_mm;
    }
  }

  std::vector<DetectedTarget> detect(double noise_px, unsigned seed) const {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0.0, 1.0);
    std::vector<DetectedTarget> detected;
    for (const auto& [id, target] : field.targets) {
      ObservedPoint p = project(camera, pose.cam_from_world(target.p_world_mm));
      p.x_px += noise_px * noise(random);
      p.y_px += noise_px * noise(random);
      detected.push_back({id, p, noise_px, 20.0, 0.0});
    }
    return detected;
  }
};

ResectConfig exact_config(double noise_floor_px) {
  ResectConfig config;
  config.noise_floor_px = noise_floor_px;
  return config;
}

}  // namespace

TEST_CASE("resect: without noise the pose comes back") {
  for (const int targets : {4, 8, 20}) {
    const Setup setup(targets);
    const auto result = resect(setup.camera, setup.detect(0.0, 1), setup.field, ResectConfig{});
    REQUIRE(result);
    CHECK((result->pose.center_world_mm - setup.pose.center_world_mm).norm() < 1e-5);  // rounding
    CHECK((result->pose.R_cam_world - setup.pose.R_cam_world).norm() < 1e-9);
    CHECK(result->reprojection_rms_px < 1e-6);
  }
}

TEST_CASE("resect: 8 targets of 0.03 px give the centre within 0.3 mm at 9 m, median over fields") {
  std::vector<double> errors;
  for (unsigned seed = 1; seed <= 41; ++seed) {
    const Setup setup(8, seed);
    const auto result = resect(setup.camera, setup.detect(0.03, seed), setup.field, exact_config(0.01));
    REQUIRE(result);
    errors.push_back((result->pose.center_world_mm - setup.pose.center_world_mm).norm());
  }
  std::nth_element(errors.begin(), errors.begin() + 20, errors.end());
  CHECK(errors[20] < 0.3);
}

TEST_CASE("resect: three targets is an error that names them, not a pose") {
  const Setup setup(3);
  const auto result = resect(setup.camera, setup.detect(0.0, 1), setup.field, ResectConfig{});
  REQUIRE(!result);
  CHECK(result.error().exit_status() == 1);
  CHECK_THAT(result.error().message, Contains("cam1") && Contains("1, 2, 3") && Contains("at least 4"));
}

TEST_CASE("resect: ids that are not in the field are listed, not used") {
  Setup setup(12);
  const auto detected = setup.detect(0.02, 1);
  setup.field.targets.erase(5);
  const auto result = resect(setup.camera, detected, setup.field, ResectConfig{});
  REQUIRE(result);
  CHECK(result->unknown_ids == std::vector<int>{5});
  CHECK(result->targets.size() == 11);
}

TEST_CASE("resect: with 30 % of the ids wrong the pose is the same and the wrong ones are marked") {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Setup setup(20, seed);
    auto detected = setup.detect(0.02, seed);
    for (std::size_t i = 0; i < 5; ++i) std::swap(detected[i].center, detected[i + 1].center);
    const auto result = resect(setup.camera, detected, setup.field, ResectConfig{});
    REQUIRE(result);
    CHECK((result->pose.center_world_mm - setup.pose.center_world_mm).norm() < 1.0);  // 14 good targets of 0.02 px
    for (const ResectedTarget& target : result->targets) CHECK(target.used == (target.id > 6));
  }
}

TEST_CASE("resect: of ten targets three with wrong ids are listed and leave the pose to the others") {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Setup setup(10, seed);
    const auto right = setup.detect(0.02, seed);
    auto detected = right;
    std::swap(detected[2].id, detected[5].id);
    detected[8].id = detected[0].id;  // twice the same id: one of the two must be wrong
    const auto result = resect(setup.camera, detected, setup.field, ResectConfig{});
    REQUIRE(result);
    auto good = right;
    for (const std::size_t i : {8U, 5U, 2U}) good.erase(good.begin() + i);
    const auto without = resect(setup.camera, good, setup.field, ResectConfig{});
    REQUIRE(without);
    CHECK((result->pose.center_world_mm - without->pose.center_world_mm).norm() < 1e-3);  // the same pose
    REQUIRE(result->targets.size() == 10);
    for (std::size_t i = 0; i < 10; ++i) CHECK(result->targets[i].used == (i != 2 && i != 5 && i != 8));
  }
}

TEST_CASE("resect: dirt that moves a quarter of the centres by half a pixel is left out") {
  int left_out = 0;
  double worst_mm = 0.0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Setup setup(16, seed);
    auto detected = setup.detect(0.02, seed);
    for (const std::size_t i : {1U, 6U, 10U, 15U}) {
      detected[i].center.x_px += 0.4;
      detected[i].center.y_px -= 0.3;
    }
    const auto result = resect(setup.camera, detected, setup.field, ResectConfig{});
    REQUIRE(result);
    for (const std::size_t i : {1U, 6U, 10U, 15U}) left_out += result->targets[i].used ? 0 : 1;
    worst_mm = std::max(worst_mm, (result->pose.center_world_mm - setup.pose.center_world_mm).norm());
  }
  CHECK(left_out >= 30);  // of 40: in a poor field the pose takes up part of one
  CHECK(worst_mm < 1.5);  // 12 clean targets of 0.02 px, some fields poor
}

TEST_CASE("resect: one target displaced by a third of a pixel is left out") {
  const Setup setup(20);
  auto detected = setup.detect(0.02, 3);
  detected[7].center.x_px += 0.35;
  const auto result = resect(setup.camera, detected, setup.field, ResectConfig{});
  REQUIRE(result);
  CHECK(!result->targets[7].used);
  CHECK(result->targets[7].dx_px == Approx(0.35).margin(0.1));  // its own noise and the pose's
}

TEST_CASE("resect: targets that contradict each other give no pose") {
  const Setup setup(8), other(8, 99);
  const auto result = resect(setup.camera, setup.detect(0.0, 1), other.field, ResectConfig{});
  REQUIRE(!result);
  CHECK(result.error().exit_status() == 1);
}

TEST_CASE("resect: the covariance is honest: the mean normalised squared error of 300 poses is near 6") {
  double sum = 0.0;
  const int repetitions = 300;
  for (int i = 0; i < repetitions; ++i) {
    const Setup setup(20, 7);
    const auto result =
        resect(setup.camera, setup.detect(0.05, 1000 + static_cast<unsigned>(i)), setup.field, exact_config(0.001));
    REQUIRE(result);
    Vector6d error;
    error.head<3>() = result->pose.center_world_mm - setup.pose.center_world_mm;
    const Eigen::Matrix3d turn = result->pose.R_cam_world * setup.pose.R_cam_world.transpose();
    error.tail<3>() = 0.5 * Eigen::Vector3d(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
    sum += error.dot(result->pose.covariance.ldlt().solve(error));
  }
  const double mean =
      sum / repetitions;  // chi squared with 6 degrees of freedom; the scale is at least 1, so a little below
  CHECK(mean > 4.0);
  CHECK(mean < 7.5);
}

TEST_CASE("resect: targets on one line do not give a pose") {
  Setup setup(8);
  for (auto& [id, target] : setup.field.targets) target.p_world_mm = Eigen::Vector3d(100.0 * id, 0.0, 500.0);
  const auto result = resect(setup.camera, setup.detect(0.0, 1), setup.field, ResectConfig{});
  CHECK(!result);
}

namespace {

// Centre of the ellipse that a disc is seen as: the pole of the line at infinity, by the dual conic.
ObservedPoint centre_of_ellipse(const CameraModel& camera, const CameraPose& pose, const Eigen::Vector3d& p_world_mm,
                                const DotDisc& disc) {
  const Eigen::Vector3d side = disc.normal.unitOrthogonal(), up = disc.normal.cross(side);
  Eigen::Matrix3d from_disc;
  from_disc << pose.R_cam_world * side, pose.R_cam_world * up, pose.cam_from_world(p_world_mm);
  from_disc.topRows<2>() *= camera.focal_length_px;
  const double r2 = disc.radius * disc.radius;
  const Eigen::Matrix3d dual = from_disc * Eigen::Vector3d(r2, r2, -1.0).asDiagonal() * from_disc.transpose();
  return distort(camera, {dual(0, 2) / dual(2, 2), dual(1, 2) / dual(2, 2)});
}

}  // namespace

TEST_CASE("resect: large dots seen aslant shift the pose; with their size and normal known the shift is gone") {
  double without_mm = 0.0, with_mm = 0.0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Setup setup(12, seed);
    auto detected = setup.detect(0.005, seed);
    DotDiscs dots;
    double largest_px = 0.0;
    for (DetectedTarget& target : detected) {
      const Eigen::Vector3d p = setup.field.targets.at(target.id).p_world_mm;
      // On two walls at right angles, each seen at 45 degrees.
      const Eigen::Vector3d normal_cam(target.id % 2 == 0 ? 0.7 : -0.7, 0.1, -0.7);
      const DotDisc disc{60.0, (setup.pose.R_cam_world.transpose() * normal_cam).normalized(), 0};
      const ObservedPoint seen = centre_of_ellipse(setup.camera, setup.pose, p, disc);
      const ObservedPoint centre = project(setup.camera, setup.pose.cam_from_world(p));
      target.center.x_px += seen.x_px - centre.x_px;
      target.center.y_px += seen.y_px - centre.y_px;
      largest_px = std::max(largest_px, std::hypot(seen.x_px - centre.x_px, seen.y_px - centre.y_px));
      dots[target.id] = disc;
    }
    CHECK(largest_px > 0.1);
    const auto without = resect(setup.camera, detected, setup.field, exact_config(0.01));
    const auto with = resect(setup.camera, detected, setup.field, exact_config(0.01), dots);
    REQUIRE(without);
    REQUIRE(with);
    without_mm += (without->pose.center_world_mm - setup.pose.center_world_mm).norm() / 10.0;
    with_mm += (with->pose.center_world_mm - setup.pose.center_world_mm).norm() / 10.0;
    CHECK(with->reprojection_rms_px < 0.015);  // the noise of two coordinates, and 64 corners for a circle
    CHECK(with->reprojection_rms_px < 0.5 * without->reprojection_rms_px);
  }
  INFO("centre off " << without_mm << " mm, with known dots " << with_mm);
  CHECK(with_mm < 0.2 * without_mm);
}
