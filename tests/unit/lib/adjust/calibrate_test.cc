#include "lib/adjust/calibrate.h"

#include <algorithm>
#include <random>

#include <catch2/catch.hpp>
#include <opencv2/calib3d.hpp>

#include "lib/adjust/calibration_review.h"
#include "lib/camera/opencv_camera.h"
#include "lib/geometry/rotation.h"
#include "tests/unit/paper_camera.h"

namespace imprint {
namespace {

TargetField make_field(std::mt19937& random) {
  std::uniform_real_distribution<double> wide(-3000, 3000), deep(-1000, 1000);
  TargetField field;
  for (int id = 1; id <= 41; ++id) field.targets[id].p_world_mm = {wide(random), wide(random), deep(random)};
  return field;
}

// Seven images from nearly one place, the camera rolled from each to the next, [B] 3.2.
std::vector<CalibrationImage> take_images(const TargetField& field, double noise_px, std::mt19937& random,
                                          const CameraModel& camera = paper_camera(), double tilt = 1.0) {
  std::normal_distribution<double> noise(0.0, noise_px);
  std::vector<CalibrationImage> images;
  for (int k = 0; k < 7; ++k) {
    CalibrationImage image;
    image.name = "image " + std::to_string(k);
    CameraPose pose;
    pose.R_cam_world =
        rotation_from_vector({0, 0, 0.9 * k}) * rotation_from_vector({tilt * (0.06 * k - 0.2), 0.1, 0.0});
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

TargetField moved_targets(TargetField field, double sigma_mm, std::mt19937& random) {
  std::normal_distribution<double> shift(0.0, sigma_mm);
  for (auto& [id, target] : field.targets)
    for (int k = 0; k < 3; ++k) target.p_world_mm[k] += shift(random);
  return field;
}

CameraModel sheared(double c2) {
  CameraModel camera = paper_camera();
  camera.distortion.affine = {0.0, c2};
  return camera;
}

bool names(const Calibration& calibration, const std::string& words) {
  return std::ranges::any_of(calibration.warnings,
                             [&](const std::string& line) { return line.find(words) != std::string::npos; });
}

// cv::calibrateCamera with k1, k2, p1, p2, k3 on the same centres. Its criterion has fx and fy apart, as ours has C1.
double focal_length_by_opencv(const std::vector<CalibrationImage>& images, const TargetField& field) {
  std::vector<std::vector<cv::Point3f>> world;
  std::vector<std::vector<cv::Point2f>> seen;
  for (const CalibrationImage& image : images) {
    auto& w = world.emplace_back();
    auto& s = seen.emplace_back();
    for (const PointObservation& point : image.points) {
      const Eigen::Vector3f p = field.targets.at(point.id).p_world_mm.cast<float>();
      w.emplace_back(p.x(), p.y(), p.z());
      s.emplace_back(static_cast<float>(point.at.x_px), static_cast<float>(point.at.y_px));
    }
  }
  cv::Mat matrix = cv::Mat(cv::Matx33d(5526.3, 0, 2327.5, 0, 5526.3, 1759.5, 0, 0, 1)), coefficients;
  std::vector<cv::Mat> turns, shifts;
  cv::calibrateCamera(world, seen, {4656, 3520}, matrix, coefficients, turns, shifts, cv::CALIB_USE_INTRINSIC_GUESS,
                      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-12});
  return matrix.at<double>(1, 1);
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
  const auto found =
      calibrate_camera(paper_camera_as_engraved(), take_images(field, 0.0, random), field, CalibrateConfig{});
  REQUIRE(found.has_value());
  CHECK(found->camera.focal_length_px == Approx(5722.79).margin(1e-3));
  CHECK(found->camera.principal_point.x_px == Approx(2367.8).margin(1e-3));
  CHECK(found->reprojection_rms_px < 1e-5);
}

TEST_CASE("calibrate: the 95 % intervals hold the truth in 90 to 99 % of the repetitions") {
  const auto truth = interior(paper_camera());
  int inside = 0, count = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    const TargetField field = make_field(random);
    const auto found =
        calibrate_camera(paper_camera_as_engraved(), take_images(field, 0.02, random), field, CalibrateConfig{});
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
  const auto found = calibrate_camera(paper_camera_as_engraved(), images, field, CalibrateConfig{});
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
  CHECK(
      calibrate_camera(paper_camera_as_engraved(), images, line, CalibrateConfig{}).error().message.find("one line") !=
      std::string::npos);

  CameraModel wrong = paper_camera_as_engraved();
  wrong.focal_length_px *= 1.5;
  const auto refused = calibrate_camera(wrong, images, field, CalibrateConfig{});
  REQUIRE_FALSE(refused.has_value());

  auto mixed = images;
  for (PointObservation& point : mixed[3].points) {  // a lens of 2 % more focal length
    point.at.x_px += 0.02 * (point.at.x_px - 2367.8) + 3e-9 * std::pow(point.at.x_px - 2367.8, 3);
    point.at.y_px += 0.02 * (point.at.y_px - 1736.9) - 4e-9 * std::pow(point.at.y_px - 1736.9, 3);
  }
  const auto named = calibrate_camera(paper_camera_as_engraved(), mixed, field, CalibrateConfig{});
  REQUIRE_FALSE(named.has_value());
  CHECK(named.error().message.find("image 3") != std::string::npos);
}

TEST_CASE("calibrate: half the images from a lens 1 % longer are noticed and both sides named") {
  std::mt19937 random(6);
  const TargetField field = make_field(random);
  auto images = take_images(field, 0.02, random);
  for (const std::size_t i : {1U, 3U, 5U}) {
    for (PointObservation& point : images[i].points) {
      point.at.x_px += 0.01 * (point.at.x_px - 2367.8);
      point.at.y_px += 0.01 * (point.at.y_px - 1736.9);
    }
  }
  const auto refused = calibrate_camera(paper_camera_as_engraved(), images, field, CalibrateConfig{});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().exit_status() == 2);
  CHECK_THAT(refused.error().message, Catch::Matchers::Contains("two cameras") &&
                                          Catch::Matchers::Contains("image 0, image 2") &&
                                          Catch::Matchers::Contains("image 1, image 3"));
}

TEST_CASE("calibrate: images that separate everything raise no warning, alike ones and a flat field do") {
  std::mt19937 random(8);
  const TargetField field = make_field(random);
  const auto images = take_images(field, 0.02, random);
  const auto good = calibrate_camera(paper_camera_as_engraved(), images, field, CalibrateConfig{});
  REQUIRE(good.has_value());
  CHECK(good->warnings.empty());

  const std::vector<CalibrationImage> alike(3, images[2]);
  const auto not_rolled = calibrate_camera(paper_camera_as_engraved(), alike, field, CalibrateConfig{});
  REQUIRE(not_rolled.has_value());
  CHECK(names(*not_rolled, "rolled by 0 deg"));

  TargetField flat = field;
  for (auto& [id, target] : flat.targets) target.p_world_mm.z() = 0.0;
  const auto square = take_images(flat, 0.02, random, paper_camera(), 0.2);
  const auto seen = calibrate_camera(paper_camera_as_engraved(), square, flat, CalibrateConfig{});
  REQUIRE(seen.has_value());
  CHECK(names(*seen, "flat"));
  CHECK(seen->ci95(0) > 10.0 * good->ci95(0));
}

TEST_CASE("calibrate: a target that has moved, a dirty one and a stranger are told apart") {
  std::mt19937 random(9);
  TargetField field = make_field(random);
  auto images = take_images(field, 0.02, random);
  const int moved_id = images[0].points[4].id;
  field.targets.at(moved_id).p_world_mm.x() += 12.0;
  const int dirty_id = images[0].points[9].id;
  images[0].points[9].at.y_px += 0.7;
  images[1].points.push_back({999, {100.0, 100.0}, 0.02});
  const auto found = calibrate_camera(paper_camera_as_engraved(), images, field, CalibrateConfig{});
  REQUIRE(found.has_value());
  CHECK(found->camera.focal_length_px == Approx(5722.79).margin(0.3));
  CHECK(found->unknown.size() == 1);
  int moved = 0, dirty = 0;
  for (const CalibrationResidual& r : found->residuals) {
    if (r.used) continue;
    const std::string why = rejection_reason(*found, r);
    if (r.id == moved_id) moved += why.find("has moved") != std::string::npos;
    if (r.id == dirty_id && r.image == 0) dirty += why.find("dirty") != std::string::npos;
  }
  CHECK(moved >= 5);  // of seven images; it may be out of view in some
  CHECK(dirty == 1);
}

TEST_CASE("calibrate: OpenCV's own calibration of the same centres gives the same focal length within 2 sigma") {
  int within = 0;
  for (unsigned seed = 11; seed <= 13; ++seed) {
    std::mt19937 random(seed);
    const TargetField field = make_field(random);
    const auto images = take_images(field, 0.02, random, sheared(0.0));
    const auto ours = calibrate_camera(paper_camera_as_engraved(), images, field, CalibrateConfig{});
    REQUIRE(ours.has_value());
    const double ours_px = to_opencv(ours->camera).camera.fy_px;  // the same notation: f at the image's centre
    const double theirs_px = focal_length_by_opencv(images, field);
    INFO("ours " << ours_px << " OpenCV " << theirs_px << " sigma " << ours->ci95(0) / 1.96);
    CHECK(std::abs(ours_px - theirs_px) < 2.0 * ours->ci95(0) / 1.96);
    ++within;
  }
  CHECK(within == 3);
}

TEST_CASE("calibrate: a field that states its uncertainty is taken at its word, one that does not is seen through") {
  std::mt19937 random(5);
  TargetField field = make_field(random);
  const auto images = take_images(field, 0.02, random);
  field = moved_targets(field, 0.2, random);
  const auto silent = calibrate_camera(paper_camera_as_engraved(), images, field, CalibrateConfig{});
  for (auto& [id, target] : field.targets) target.sigma_mm = 0.2;
  const auto stated = calibrate_camera(paper_camera_as_engraved(), images, field, CalibrateConfig{});
  REQUIRE(silent.has_value());
  REQUIRE(stated.has_value());
  CHECK(silent->target_sigma_mm == Approx(0.2).epsilon(0.35));  // of 41 targets, hardly any of it in depth
  CHECK(stated->target_sigma_mm < 0.1);                         // nothing left to explain
  CHECK(stated->reprojection_rms_px < 0.04);
  for (const auto& found : {*silent, *stated})
    CHECK(std::abs(found.camera.focal_length_px - 5722.79) < 1.5 * found.ci95(0));
}

TEST_CASE("calibrate: targets seen beside their place alike in all images widen the intervals, which hold the truth") {
  const auto truth = interior(paper_camera());
  int inside = 0, count = 0;
  double sigma_mm = 0.0;
  const int repetitions = 30;
  for (unsigned seed = 1; seed <= repetitions; ++seed) {
    std::mt19937 random(seed);
    const TargetField field = make_field(random);
    // 0.02 px: uneven print, light or tilt of the dots, with 0.01 px of noise.
    const auto images = take_images(moved_targets(field, 0.028, random), 0.01, random);
    const auto found = calibrate_camera(paper_camera_as_engraved(), images, field, CalibrateConfig{});
    REQUIRE(found.has_value());
    sigma_mm += found->target_sigma_mm / repetitions;
    const auto values = interior(found->camera);
    for (int i = 0; i < kInteriorTerms; ++i, ++count)
      inside += std::abs(values[static_cast<std::size_t>(i)] - truth[static_cast<std::size_t>(i)]) < found->ci95(i);
  }
  CHECK(sigma_mm == Approx(0.028).epsilon(0.1));
  CHECK(inside > 0.90 * count);
  CHECK(inside < 0.99 * count);
}

}  // namespace imprint
