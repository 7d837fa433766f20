#include "lib/adjust/calibrate.h"

#include <random>

#include <catch2/catch.hpp>

#include "lib/geometry/rotation.h"

namespace imprint {
namespace {

CameraModel true_camera() {
  CameraModel camera;
  camera.id = "cam1";
  camera.width_px = 4656;
  camera.height_px = 3520;
  camera.pixel_pitch_um = 3.8;
  camera.focal_length_px = 5722.79;
  camera.principal_point = {2367.8, 1736.88};
  camera.distortion.radial = {-6.325e-3, 5.246e-4, 1.301e-5};
  camera.distortion.tangential = {-8.541e-5, 6.5e-5};
  camera.distortion.affine = {1.231e-4, 1.216e-4};
  return camera;
}

CameraModel nominal_camera() {
  CameraModel camera = true_camera();
  camera.focal_length_px = 21000.0 / 3.8;
  camera.principal_point = {2327.5, 1759.5};
  camera.distortion = {};
  return camera;
}

TargetField make_field(std::mt19937& random) {
  std::uniform_real_distribution<double> wide(-3000, 3000), deep(-1000, 1000);
  TargetField field;
  for (int id = 1; id <= 41; ++id) field.targets[id].p_world_mm = {wide(random), wide(random), deep(random)};
  return field;
}

// Seven images from nearly one place, the camera rolled from each to the next, [B] 3.2.
std::vector<CalibrationImage> take_images(const TargetField& field, double noise_px, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, noise_px);
  const CameraModel camera = true_camera();
  std::vector<CalibrationImage> images;
  for (int k = 0; k < 7; ++k) {
    CalibrationImage image;
    image.name = "image " + std::to_string(k);
    CameraPose pose;
    pose.R_cam_world = rotation_from_vector({0, 0, 0.9 * k}) * rotation_from_vector({0.06 * k - 0.2, 0.1, 0.0});
    pose.center_world_mm = -pose.R_cam_world.transpose() * Eigen::Vector3d(100.0 * k - 300.0, 150.0, 8000.0);
    for (const auto& [id, target] : field.targets) {
      const Eigen::Vector3d p = pose.cam_from_world(target.p_world_mm);
      const ObservedPoint at = project(camera, p);
      if (at.x_px < 30 || at.y_px < 30 || at.x_px > 4626 || at.y_px > 3490) continue;
      image.points.push_back({id, {at.x_px + noise(random), at.y_px + noise(random)}, noise_px});
    }
    image.start = pose;
    image.start.R_cam_world = rotation_from_vector({0.004, -0.003, 0.002}) * pose.R_cam_world;
    image.start.center_world_mm += Eigen::Vector3d(30, -20, 150);
    images.push_back(std::move(image));
  }
  return images;
}

std::array<double, kInteriorTerms> interior(const CameraModel& camera) {
  std::array<double, kInteriorTerms> values{camera.focal_length_px, camera.principal_point.x_px,
                                            camera.principal_point.y_px};
  const auto terms = camera.distortion.terms();
  std::copy(terms.begin(), terms.end(), values.begin() + 3);
  return values;
}

}  // namespace

TEST_CASE("calibrate: exact centres give back the camera") {
  std::mt19937 random(1);
  const TargetField field = make_field(random);
  const auto found = calibrate_camera(nominal_camera(), take_images(field, 0.0, random), field, CalibrateConfig{});
  REQUIRE(found.has_value());
  CHECK(found->camera.focal_length_px == Approx(5722.79).margin(1e-3));
  CHECK(found->camera.principal_point.x_px == Approx(2367.8).margin(1e-3));
  CHECK(found->reprojection_rms_px < 1e-5);
}

TEST_CASE("calibrate: the 95 % intervals hold the truth in 90 to 99 % of the repetitions") {
  const auto truth = interior(true_camera());
  int inside = 0, count = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    const TargetField field = make_field(random);
    const auto found = calibrate_camera(nominal_camera(), take_images(field, 0.02, random), field, CalibrateConfig{});
    REQUIRE(found.has_value());
    CHECK(found->reprojection_rms_px < 0.032);  // the length of two components of 0.02 px
    const auto values = interior(found->camera);
    for (int i = 0; i < kInteriorTerms; ++i, ++count)
      inside += std::abs(values[static_cast<std::size_t>(i)] - truth[static_cast<std::size_t>(i)]) < found->ci95(i);
  }
  CHECK(inside > 0.90 * count);
  CHECK(inside < 0.99 * count);
}

TEST_CASE("calibrate: wrong ids are named and change nothing") {
  std::mt19937 random(3);
  const TargetField field = make_field(random);
  auto images = take_images(field, 0.02, random);
  for (auto& image : images) std::swap(image.points[2].id, image.points[7].id);
  const auto found = calibrate_camera(nominal_camera(), images, field, CalibrateConfig{});
  REQUIRE(found.has_value());
  CHECK(found->camera.focal_length_px == Approx(5722.79).margin(0.3));
  int rejected = 0;
  for (const CalibrationResidual& r : found->residuals) rejected += r.used ? 0 : 1;
  CHECK(rejected >= 14);
  CHECK(rejected <= 17);
}

TEST_CASE("calibrate: targets on a line, an image of another camera and a wrong focal length are refused") {
  std::mt19937 random(4);
  const TargetField field = make_field(random);
  auto images = take_images(field, 0.02, random);

  TargetField line = field;
  for (auto& [id, target] : line.targets) target.p_world_mm = {100.0 * id, 5.0 * id, 0.0};
  CHECK(calibrate_camera(nominal_camera(), images, line, CalibrateConfig{}).error().message.find("one line") !=
        std::string::npos);

  CameraModel wrong = nominal_camera();
  wrong.focal_length_px *= 1.5;
  const auto refused = calibrate_camera(wrong, images, field, CalibrateConfig{});
  REQUIRE_FALSE(refused.has_value());

  auto mixed = images;
  for (PointObservation& point : mixed[3].points) {  // a lens of 2 % more focal length
    point.at.x_px += 0.02 * (point.at.x_px - 2367.8) + 3e-9 * std::pow(point.at.x_px - 2367.8, 3);
    point.at.y_px += 0.02 * (point.at.y_px - 1736.9) - 4e-9 * std::pow(point.at.y_px - 1736.9, 3);
  }
  const auto named = calibrate_camera(nominal_camera(), mixed, field, CalibrateConfig{});
  REQUIRE_FALSE(named.has_value());
  CHECK(named.error().message.find("image 3") != std::string::npos);
}

TEST_CASE("calibrate: a field that states its uncertainty is taken at its word") {
  std::mt19937 random(5);
  TargetField field = make_field(random);
  const auto images = take_images(field, 0.02, random);
  std::normal_distribution<double> error(0.0, 0.2);
  for (auto& [id, target] : field.targets) {
    for (int k = 0; k < 3; ++k) target.p_world_mm[k] += error(random);
  }
  const auto exact = calibrate_camera(nominal_camera(), images, field, CalibrateConfig{});
  for (auto& [id, target] : field.targets) target.sigma_mm = 0.2;
  const auto stated = calibrate_camera(nominal_camera(), images, field, CalibrateConfig{});
  REQUIRE(exact.has_value());
  REQUIRE(stated.has_value());
  CHECK(stated->reprojection_rms_px < 0.04);
  CHECK(exact->reprojection_rms_px > 2.0 * stated->reprojection_rms_px);
  CHECK(std::abs(stated->camera.focal_length_px - 5722.79) < 1.5 * stated->ci95(0));
}

}  // namespace imprint
