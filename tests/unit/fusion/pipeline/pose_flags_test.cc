#include <algorithm>

#include <catch2/catch.hpp>

#include "fusion/fusion_pipeline.h"
#include "tests/unit/fusion/triangulate/forging_views.h"

using namespace imprint;

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

// One rod seen by three cameras in three observations, one a second, as nodes that keep their poses send it.
std::vector<Observation> three_observations() {
  const test::Rod rod;
  const test::Lying lying;
  std::vector<Observation> observations;
  for (int index = 0; index < 3; ++index) {
    Observation observation;
    observation.index = index;
    for (const test::Pinhole& camera : test::forge_cameras()) {
      Imprint imprint = test::view_rod(rod, lying, camera);
      imprint.sensor_time_ns = (index + 1) * kSecond;
      imprint.pose_state = PoseState::hold;
      observation.imprints.push_back(std::move(imprint));
    }
    observations.push_back(std::move(observation));
  }
  return observations;
}

const CameraShare& share(const Measurement& measurement, std::size_t observation, const std::string& id) {
  const auto& cameras = measurement.observations.at(observation).cameras;
  return *std::ranges::find(cameras, id, &CameraShare::id);
}

}  // namespace

TEST_CASE("fuse: a camera found moved makes doubtful what it saw since it stood still, and nothing else") {
  auto observations = three_observations();
  const std::string id = observations[2].imprints[0].camera_id;
  const std::string other = observations[2].imprints[1].camera_id;
  Imprint& moved = observations[2].imprints[0];
  moved.pose_state = PoseState::moved;
  moved.pose_doubtful = true;
  moved.pose_doubtful_since_ns = 1 * kSecond;  // confirmed in the first observation
  const auto measurement = fuse(observations, test::forge_spec(), "s", "best");
  REQUIRE(measurement);
  CHECK_FALSE(share(*measurement, 0, id).pose_doubtful);
  CHECK(share(*measurement, 1, id).pose_doubtful);
  CHECK(share(*measurement, 2, id).pose_doubtful);
  for (std::size_t i = 0; i < 3; ++i) CHECK_FALSE(share(*measurement, i, other).pose_doubtful);
  CHECK(std::ranges::count_if(measurement->warnings, [&](const std::string& warning) {
          return warning.find(id) != std::string::npos && warning.find("doubtful") != std::string::npos;
        }) == 2);

  const auto json = to_json(*measurement);
  const auto& camera = json.at("observations").at(2).at("cameras").at(0);
  CHECK(camera.at("pose_state") == "moved");
  CHECK(camera.at("pose_doubtful") == true);
  const auto back = measurement_from_json(json);
  REQUIRE(back);
  CHECK(share(*back, 2, id).pose_state == PoseState::moved);
  CHECK(share(*back, 1, id).pose_doubtful);
  CHECK(share(*back, 0, other).pose_state == PoseState::hold);
}

TEST_CASE("fuse: held poses that were confirmed raise nothing") {
  const auto measurement = fuse(three_observations(), test::forge_spec(), "s", "best");
  REQUIRE(measurement);
  for (const std::string& warning : measurement->warnings) CHECK(warning.find("doubtful") == std::string::npos);
}
