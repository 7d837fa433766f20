#include "cli/calibration_start.h"

#include <random>

#include <catch2/catch.hpp>

#include "cli/calibration_sheet.h"
#include "tests/unit/paper_camera.h"

using namespace imprint;
using Catch::Matchers::Contains;

namespace {

struct View {
  CameraModel camera;  // as its maker states it
  CameraPose pose;
  TargetField field;
  std::vector<DetectedTarget> targets;

  View() {
    camera = paper_camera_as_engraved();
    const CameraModel lens = paper_camera();
    pose.R_cam_world = rotation_from_vector({0.1, -0.2, 0.3});
    pose.center_world_mm = -pose.R_cam_world.transpose() * Eigen::Vector3d(100.0, 150.0, 8000.0);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> wide(-2500, 2500), deep(-1000, 1000);
    for (int id = 1; id <= 41; ++id) {
      const Eigen::Vector3d p(wide(random), wide(random), deep(random));
      const ObservedPoint at = project(lens, pose.cam_from_world(p));
      field.targets[id].p_world_mm = p;
      if (at.x_px > 20 && at.y_px > 20 && at.x_px < 4636 && at.y_px < 3500)
        targets.push_back({id, at, 0.02, 20.0, 0.0});
    }
  }
};

}  // namespace

TEST_CASE("calibrate: the start pose is found with the lens as engraved") {
  const View view;
  const auto start = calibration_start(view.camera, view.targets, view.field);
  REQUIRE(start);
  CHECK((start->center_world_mm - view.pose.center_world_mm).norm() < 500.0);  // 3.5 % of focal length over 8 m
}

TEST_CASE("calibrate: a mirrored field is refused, and said to be one") {
  View view;
  for (auto& [id, target] : view.field.targets) target.p_world_mm.y() *= -1.0;
  const auto start = calibration_start(view.camera, view.targets, view.field);
  REQUIRE(!start);
  CHECK(start.error().exit_status() == 2);
  CHECK_THAT(start.error().message, Contains("mirror image"));
}

TEST_CASE("calibrate: a mirrored field that is flat but for five targets is refused too; the right one is not") {
  View view;
  int raised = 0;
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 0.02);
  for (auto& [id, target] : view.field.targets) target.p_world_mm.z() = id % 7 == 0 && ++raised <= 5 ? 800.0 : 0.0;
  view.pose.R_cam_world = rotation_from_vector({0.4, -0.3, 0.3});
  view.pose.center_world_mm = -view.pose.R_cam_world.transpose() * Eigen::Vector3d(100.0, 150.0, 8000.0);
  view.targets.clear();
  for (const auto& [id, target] : view.field.targets) {
    const ObservedPoint at = project(view.camera, view.pose.cam_from_world(target.p_world_mm));
    view.targets.push_back({id, {at.x_px + noise(random), at.y_px + noise(random)}, 0.02, 20.0, 0.0});
  }
  CHECK(calibration_start(view.camera, view.targets, view.field));
  for (auto& [id, target] : view.field.targets) target.p_world_mm.x() *= -1.0;
  const auto start = calibration_start(view.camera, view.targets, view.field);
  REQUIRE(!start);
  CHECK_THAT(start.error().message, Contains("mirror image"));
}

TEST_CASE("calibrate: a field whose targets stand on one line is refused for that") {
  View view;
  for (auto& [id, target] : view.field.targets) target.p_world_mm = {100.0 * id, 5.0 * id, 0.0};
  const auto start = calibration_start(view.camera, view.targets, view.field);
  REQUIRE(!start);
  CHECK(start.error().exit_status() == 2);
  CHECK_THAT(start.error().message, Contains("on one line"));
}

TEST_CASE("calibrate: a pixel pitch wrong by ten either way is refused, with the focal length that would fit") {
  for (const double factor : {10.0, 0.1}) {
    View view;
    view.camera.pixel_pitch_um *= factor;
    view.camera.focal_length_px /= factor;
    const auto start = calibration_start(view.camera, view.targets, view.field);
    REQUIRE(!start);
    CHECK(start.error().exit_status() == 2);
    CHECK_THAT(start.error().message, Contains("--pixel-pitch-um") && Contains("times as long"));
  }
}

TEST_CASE("calibrate: an image of a much longer lens is refused with its focal length") {
  View view;
  for (DetectedTarget& target : view.targets) {  // 35 mm instead of 21: the image about its centre
    target.center.x_px = 2327.5 + 1.667 * (target.center.x_px - 2327.5);
    target.center.y_px = 1759.5 + 1.667 * (target.center.y_px - 1759.5);
  }
  const auto start = calibration_start(view.camera, view.targets, view.field);
  REQUIRE(!start);
  CHECK_THAT(start.error().message, Contains("of this camera"));
}

TEST_CASE("calibration record: PNG and PDF are drawn whole, with hundreds of targets left out and none used") {
  const View view;
  Calibration calibration;
  calibration.camera = view.camera;
  calibration.covariance = InteriorMatrix::Identity() * 1e-6;
  calibration.reprojection_rms_px = 0.02;
  std::vector<CalibrationImage> images{{"one.png", view.pose, {}}};
  for (const bool used : {true, false}) {
    calibration.residuals.clear();
    for (int i = 0; i < 300; ++i)
      calibration.residuals.push_back({0, i, {15.0 * i, 10.0 * i}, 0.01 * (i % 5), -0.02, used});
    calibration.poses = {view.pose};
    const CalibrationSheet sheet{calibration, images, view.field, "field.csv", "2026-01-01T00:00:00Z"};
    const auto png = draw_residuals_png(sheet);
    REQUIRE(png);
    CHECK(png->substr(1, 3) == "PNG");
    CHECK(png->substr(png->size() - 8, 4) == "IEND");
    const auto pdf = draw_record_pdf(sheet);
    REQUIRE(pdf);
    CHECK(pdf->starts_with("%PDF"));
    CHECK_THAT(*pdf, Contains("%%EOF"));
  }
}
