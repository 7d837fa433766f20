#include "survey/verify.h"

#include <random>

#include <catch2/catch.hpp>

#include "lib/camera/camera_pose.h"
#include "lib/geometry/rotation.h"

namespace imprint {
namespace {

// Two cameras 3 m apart look at a field 8 m away; a bar of 2 m, targets 901 and 902, lies before it.
struct Rig {
  TargetField field;
  std::vector<VerifyView> views;
  ScaleBar bar{901, 902, 0.0, 0.005};
  TargetField all;  // the bar's ends too
};

CameraModel camera_of(const std::string& id) {
  CameraModel camera;
  camera.id = id;
  camera.width_px = 4656;
  camera.height_px = 3520;
  camera.pixel_pitch_um = 3.8;
  camera.focal_length_px = 5722.79;
  camera.principal_point = {2367.8, 1736.88};
  camera.distortion.radial = {-6.3e-3, 5.2e-4, 1.3e-5};
  return camera;
}

Rig make_rig(unsigned seed, double noise_px) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> wide(-2000, 2000), deep(-700, 700);
  std::normal_distribution<double> noise(0.0, noise_px);
  Rig rig;
  for (int id = 1; id <= 25; ++id) rig.field.targets[id].p_world_mm = {wide(random), wide(random), deep(random)};
  rig.all = rig.field;
  rig.all.targets[901].p_world_mm = {-990.0, 40.0, -100.0};
  rig.all.targets[902].p_world_mm = {1010.0, -30.0, 150.0};
  rig.bar.length_mm = (rig.all.targets[901].p_world_mm - rig.all.targets[902].p_world_mm).norm();
  for (int k = 0; k < 2; ++k) {
    CameraPose pose;
    pose.R_cam_world = rotation_from_vector({0.02, k == 0 ? 0.19 : -0.19, 0.01 * k});
    pose.center_world_mm = -pose.R_cam_world.transpose() * Eigen::Vector3d(0.0, 0.0, 8000.0);
    VerifyView view{camera_of("cam" + std::to_string(k + 1)), {}};
    for (const auto& [id, target] : rig.all.targets) {
      const ObservedPoint at = project(view.camera, pose.cam_from_world(target.p_world_mm));
      DetectedTarget seen;
      seen.id = id;
      seen.center = {at.x_px + noise(random), at.y_px + noise(random)};
      seen.sigma_px = noise_px;
      view.targets.push_back(seen);
    }
    rig.views.push_back(std::move(view));
  }
  return rig;
}

}  // namespace

TEST_CASE("verify: exact centres give back the bar and the targets") {
  const Rig rig = make_rig(1, 0.0);
  VerifyChecks checks{{rig.bar}, {}};
  checks.targets.targets[7] = rig.all.targets.at(7);
  const auto report = verify_rig(rig.views, rig.field, checks);
  REQUIRE(report.has_value());
  REQUIRE(report->checks.size() == 2);
  CHECK(std::abs(report->checks[0].deviation_mm) < 1e-4);
  CHECK(std::abs(report->checks[1].deviation_mm) < 1e-4);
  CHECK(report->checks[0].cameras == std::vector<std::string>{"cam1", "cam2"});
}

TEST_CASE("verify: the 95 % interval of a bar holds its deviation in 85 to 100 % of the repetitions") {
  int inside = 0;
  double squares = 0.0, widths = 0.0;
  constexpr int kRepetitions = 40;
  for (unsigned seed = 1; seed <= kRepetitions; ++seed) {
    Rig rig = make_rig(seed, 0.1);
    std::mt19937 random(seed + 1000);
    rig.bar.length_mm += std::normal_distribution<double>(0.0, rig.bar.sigma_mm)(random);
    const auto report = verify_rig(rig.views, rig.field, {{rig.bar}, {}});
    REQUIRE(report.has_value());
    const Verification& check = report->checks.front();
    inside += std::abs(check.deviation_mm) < check.ci95_mm ? 1 : 0;
    squares += check.deviation_mm * check.deviation_mm;
    widths += check.ci95_mm;
  }
  CHECK(inside >= 34);  // 95 % less three standard deviations of a count of 40
  // Not by being wide: the spread of 40 deviations is known to 11 %, the noise floor adds some.
  CHECK(widths / kRepetitions < 1.5 * 1.96 * std::sqrt(squares / kRepetitions));
}

TEST_CASE("verify: a camera that was recalibrated wrongly shows in the bar") {
  Rig rig = make_rig(2, 0.02);
  for (VerifyView& view : rig.views) view.camera.focal_length_px *= 1.002;
  for (auto& [id, target] : rig.field.targets) target.p_world_mm *= 1.001;  // the field was measured anew, too large
  const auto report = verify_rig(rig.views, rig.field, {{rig.bar}, {}});
  REQUIRE(report.has_value());
  CHECK(std::abs(report->checks.front().deviation_mm) > 1.0);  // 0.1 % of 2 m
  CHECK(std::abs(report->checks.front().deviation_mm) > report->checks.front().ci95_mm);
}

TEST_CASE("verify: a target to be checked has no part in the pose") {
  Rig rig = make_rig(3, 0.0);
  VerifyChecks checks;
  checks.targets.targets[5] = rig.field.targets.at(5);
  checks.targets.targets[5].p_world_mm += Eigen::Vector3d(0.0, 2.0, 0.0);  // it stands 2 mm beside its place
  rig.field.targets[5] = checks.targets.targets[5];
  const auto report = verify_rig(rig.views, rig.field, checks);
  REQUIRE(report.has_value());
  CHECK(report->checks.front().deviation_mm == Approx(2.0).margin(1e-3));
}

TEST_CASE("verify: what cannot be measured is said, with the reason") {
  Rig rig = make_rig(4, 0.02);
  SECTION("an end that one camera sees") {
    std::erase_if(rig.views[1].targets, [](const DetectedTarget& t) { return t.id == 902; });
    const auto report = verify_rig(rig.views, rig.field, {{rig.bar}, {}});
    REQUIRE_FALSE(report.has_value());
    CHECK(report.error().message.find("target 902 is seen by 1 cameras") != std::string::npos);
    CHECK(report.error().exit_status() == 1);
  }
  SECTION("a camera without targets") {
    rig.views[0].targets.clear();
    const auto report = verify_rig(rig.views, rig.field, {{rig.bar}, {}});
    REQUIRE_FALSE(report.has_value());
    CHECK(report.error().message.find("cam1") != std::string::npos);
  }
  SECTION("a wrong id") {
    for (DetectedTarget& t : rig.views[1].targets)
      if (t.id == 902) t.center.y_px += 300.0;
    const auto report = verify_rig(rig.views, rig.field, {{rig.bar}, {}});
    REQUIRE_FALSE(report.has_value());
    CHECK(report.error().message.find("miss each other") != std::string::npos);
  }
  SECTION("nothing to check") { CHECK_FALSE(verify_rig(rig.views, rig.field, {}).has_value()); }
}

}  // namespace imprint
