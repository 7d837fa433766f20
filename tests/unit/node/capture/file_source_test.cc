#include "node/capture/file_source.h"

#include <catch2/catch.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

void write_picture(const std::filesystem::path& path, int grey) {
  REQUIRE(cv::imwrite(path.string(), cv::Mat(4, 6, CV_8UC1, cv::Scalar(grey))));
}

constexpr const char* kSession = R"(
rig = "rig.toml"
[[observation]]
rotation_deg = 0.0
[observation.images]
cam1 = "a.png"
[[observation]]
rotation_deg = 90.0
[observation.images]
cam1 = "b.png"
cam2 = "c.png"
)";

}  // namespace

TEST_CASE("capture: a folder gives the picture of the triggered observation and of this camera") {
  const TemporaryFolder folder;
  write_picture(folder / "obs00_cam1.png", 10);
  write_picture(folder / "obs12_cam1.tif", 20);
  auto source = open_folder_source(folder.path(), "cam1");
  REQUIRE(source);
  REQUIRE((*source)->capture({"S", 0, 0.0})->image.at<std::uint8_t>(0, 0) == 10);
  REQUIRE((*source)->capture({"T", 12, 0.0})->image.at<std::uint8_t>(0, 0) == 20);
  const auto absent = (*source)->capture({"S", 1, 0.0});
  REQUIRE_FALSE(absent);
  REQUIRE(absent.error().message.find("obs01_cam1.png") != std::string::npos);
  REQUIRE_FALSE(open_folder_source(folder / "nowhere", "cam1"));
}

TEST_CASE("capture: a session file gives its picture and a contradicting rotation is said") {
  const TemporaryFolder folder;
  folder.write("session.toml", kSession);
  write_picture(folder / "a.png", 10);
  write_picture(folder / "b.png", 20);
  auto source = open_session_source(folder / "session.toml", "cam1");
  REQUIRE(source);
  const auto first = (*source)->capture({"S", 0, 0.0});
  REQUIRE(first);
  REQUIRE(first->warnings.empty());
  const auto turned = (*source)->capture({"S", 1, 45.0});
  REQUIRE(turned);
  REQUIRE(turned->image.at<std::uint8_t>(0, 0) == 20);
  REQUIRE(turned->warnings.size() == 1);
  REQUIRE(turned->warnings[0].find("rotation 90 deg, the trigger 45 deg") != std::string::npos);
  REQUIRE((*source)->capture({"S", 2, 0.0}).error().message.find("has 2 observation(s)") != std::string::npos);
  REQUIRE(
      (*open_session_source(folder / "session.toml", "cam2"))->capture({"S", 0, 0.0}).error().message.find("cam2") !=
      std::string::npos);
  REQUIRE_FALSE(open_session_source(folder / "session.toml", "cam3"));
}

}  // namespace imprint
