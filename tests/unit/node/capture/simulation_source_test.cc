#include "node/capture/simulation_source.h"

#include <catch2/catch.hpp>

#include "node/capture/image_file.h"
#include "simulation/scene.h"
#include "simulation/simulation.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

const std::filesystem::path kScene = std::filesystem::path(IMPRINT_TEST_DATA) / "small_laboratory.toml";

bool same_picture(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

}  // namespace

TEST_CASE("capture: a simulated camera gives the very pictures that `imprint simulate` writes") {
  const TemporaryFolder folder;
  const auto scene = read_scene(kScene);
  REQUIRE(scene);
  REQUIRE(write_simulation(
      *scene, folder.path(), [](std::string_view, double) {}, 2));
  const auto source = open_frame_source("simulation", kScene, "cam2");
  REQUIRE(source);
  for (const int observation : {0, 2}) {
    CAPTURE(observation);
    const auto frame = (*source)->capture({"S", observation, 60.0 * observation});
    REQUIRE(frame);
    const auto written = read_image(folder / fmt::format("obs{:02}_cam2.png", observation), nullptr);
    REQUIRE(written);
    REQUIRE(same_picture(frame->image, written->image));
    REQUIRE(frame->source.find("small_laboratory.toml") != std::string::npos);
  }
}

TEST_CASE("capture: a simulated camera gives the same picture each time it is asked, another for another observation") {
  const auto source = open_frame_source("simulation", kScene, "cam1");
  REQUIRE(source);
  const auto once = (*source)->capture({"S", 0, 0.0}), again = (*source)->capture({"T", 0, 0.0}),
             turned = (*source)->capture({"S", 1, 60.0});
  REQUIRE(once);
  REQUIRE(again);
  REQUIRE(turned);
  REQUIRE(same_picture(once->image, again->image));
  REQUIRE_FALSE(same_picture(once->image, turned->image));
}

TEST_CASE("capture: a simulated camera names the scene, the camera or the observation that is not there") {
  const auto fault = [](const std::filesystem::path& scene, const std::string& camera, int observation) {
    const auto source = open_frame_source("simulation", scene, camera);
    if (!source) return source.error().message;
    const auto frame = (*source)->capture({"S", observation, 0.0});
    REQUIRE_FALSE(frame);
    return frame.error().message;
  };
  REQUIRE(fault("no_such_scene.toml", "cam1", 0).find("no_such_scene.toml") != std::string::npos);
  REQUIRE(fault(kScene, "cam9", 0).find("cam9") != std::string::npos);
  REQUIRE(fault(kScene, "cam1", 3).find("observations 0 to 2, asked for 3") != std::string::npos);
}

}  // namespace imprint
