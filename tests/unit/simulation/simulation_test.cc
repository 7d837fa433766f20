#include "simulation/simulation.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <mutex>

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "lib/camera/camera_pose.h"
#include "lib/config/atomic_file.h"
#include "lib/rig/rig.h"
#include "simulation/layout.h"
#include "simulation/scene.h"
#include "simulation/truth.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

Scene quick_scene() {
  auto scene = read_scene(IMPRINT_TEST_DATA "/small_forge.toml");
  REQUIRE(scene);
  scene->observations.rotations_deg = {0.0, 90.0};
  return *scene;
}

std::map<std::string, std::string> files_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files[entry.path().filename().string()] = read_file(entry.path()).value();
  }
  return files;
}

Eigen::Vector3d vector_of(const nlohmann::json& json) {
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

Eigen::Matrix3d matrix_of(const nlohmann::json& json) {
  Eigen::Matrix3d m;
  for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = json[static_cast<std::size_t>(i)].get<double>();
  return m;
}

}  // namespace

TEST_CASE("simulation: files are the same byte for byte with one job and with three") {
  const TemporaryFolder folder;
  const Scene scene = quick_scene();
  double last = 0.0;
  REQUIRE(write_simulation(
      scene, folder / "one", [&](std::string_view, double done) { last = std::max(last, done); }, 1));
  REQUIRE(write_simulation(scene, folder / "three", {}, 3));
  CHECK(last == 1.0);
  const auto one = files_of(folder / "one"), three = files_of(folder / "three");
  CHECK(one.size() == 14);  // 6 images, 3 cameras, library, field, rig, session, truth: nothing temporary
  CHECK(one == three);
}

TEST_CASE("simulation: what it writes is a session that reads back, and a truth that agrees with it") {
  const TemporaryFolder folder;
  const Scene scene = quick_scene();
  REQUIRE(write_simulation(scene, folder.path(), {}, 2));
  const auto session = read_session_file(folder / "session.toml");
  REQUIRE(session);
  const auto rig = read_rig(session->rig);
  REQUIRE(rig);
  REQUIRE(session->observations.size() == 2);
  CHECK(session->observations[1].rotation_deg == 90.0);
  for (const auto& [id, path] : session->observations[1].images) {
    const cv::Mat image = cv::imread(path.string(), cv::IMREAD_UNCHANGED);
    CHECK(image.size() == cv::Size(1164, 880));
    CHECK(image.type() == CV_8U);
  }

  const auto truth = nlohmann::json::parse(read_file(folder / "truth.json").value());
  CHECK(truth.at("schema") == "imprint.truth/1");
  const auto& first = truth.at("observations").at(0);
  const Eigen::Matrix3d R_forging_world = matrix_of(first.at("R_forging_world"));
  const Eigen::Vector3d origin = vector_of(first.at("origin_world_mm"));
  CHECK((R_forging_world * R_forging_world.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-12);
  CHECK(R_forging_world.determinant() == Approx(1.0));
  CHECK(R_forging_world.row(0).dot(rig->forging.axis_direction_world) > 0.9);
  CHECK(std::abs(R_forging_world(1, 2)) < 1e-12);  // y of the forging is level

  for (const auto& camera_truth : first.at("cameras")) {
    const CameraModel* camera = rig->find_camera(camera_truth.at("id").get<std::string>());
    REQUIRE(camera != nullptr);
    CameraPose pose;
    pose.R_cam_world = matrix_of(camera_truth.at("R_cam_world"));
    pose.center_world_mm = vector_of(camera_truth.at("center_mm"));
    for (const auto& target : camera_truth.at("targets")) {
      const auto found = rig->field.targets.find(target.at("id").get<int>());
      REQUIRE(found != rig->field.targets.end());
      const ObservedPoint seen = project(*camera, pose.cam_from_world(found->second.p_world_mm));
      // field.csv and truth.json each carry more digits than this.
      CHECK(std::hypot(seen.x_px - target.at("x_px").get<double>(), seen.y_px - target.at("y_px").get<double>()) <
            1e-3);
    }
    CHECK(camera_truth.at("targets").size() >= 8);
    const auto& axis = camera_truth.at("axis");
    REQUIRE(axis.size() == truth.at("sections").size());
    for (std::size_t i = 0; i < axis.size(); i += 100) {
      const Eigen::Vector3d p_world =
          R_forging_world.transpose() * vector_of(truth.at("sections").at(i).at("axis_mm")) + origin;
      const ObservedPoint seen = project(*camera, pose.cam_from_world(p_world));
      CHECK(std::hypot(seen.x_px - axis[i][0].get<double>(), seen.y_px - axis[i][1].get<double>()) <
            2e-4);  // rounded to 1e-4
    }
    const auto& upper = camera_truth.at("upper");
    const auto& lower = camera_truth.at("lower");
    CHECK(upper[upper.size() / 2][1].get<double>() < lower[lower.size() / 2][1].get<double>());
  }
}

TEST_CASE("simulation: the manipulator errs within its limits and the truth says how") {
  const Scene scene = quick_scene();
  const auto layout = lay_out(scene);
  REQUIRE(layout);
  const auto text = truth_json(scene, *layout);
  REQUIRE(text);
  const auto truth = nlohmann::json::parse(*text);
  for (const auto& observation : truth.at("observations")) {
    const Eigen::Vector3d shift_mm = vector_of(observation.at("shift_mm"));
    CHECK(shift_mm.cwiseAbs().maxCoeff() <= scene.observations.position_error_mm);
    CHECK(shift_mm.norm() > 0.0);
    // The middle of the ideal axis lies off its place by the shift.
    const Eigen::Vector3d middle =
        vector_of(observation.at("origin_world_mm")) +
        matrix_of(observation.at("R_forging_world")).row(0).transpose() * 0.5 * truth.at("length_mm").get<double>();
    CHECK((middle - scene.forging.center_world_mm - shift_mm).norm() < 1e-9);
    const double error =
        observation.at("true_rotation_deg").get<double>() - observation.at("rotation_deg").get<double>();
    CHECK(std::abs(error) <= scene.observations.rotation_error_deg);
    CHECK(error != 0.0);
  }
}

TEST_CASE("simulation: a folder that cannot be made is an error that names it") {
  const TemporaryFolder folder;
  const auto file = folder.write("taken", "a file");
  const auto written = write_simulation(quick_scene(), file / "below", {}, 1);
  REQUIRE_FALSE(written);
  CHECK(written.error().kind == ErrorKind::invalid_input);
  CHECK_THAT(written.error().message, Catch::Contains("taken"));
}

}  // namespace imprint
