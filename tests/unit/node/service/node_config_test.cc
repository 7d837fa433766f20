#include "node/node_config.h"

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

constexpr const char* kSmallest = R"(
[node]
camera_id = "cam1"
rig = "rig.toml"
[capture]
source = "folder"
path = "images"
)";

Result<NodeConfig> read(const TemporaryFolder& folder, const std::string& text, const std::string& override_text = "") {
  const auto path = folder.write("node.toml", text);
  auto table = parse_toml_file(path);
  REQUIRE(table);
  if (!override_text.empty()) REQUIRE(apply_override(*table, override_text));
  return read_node_config(path, *table);
}

std::string fault(const std::string& text, const std::string& override_text = "") {
  const TemporaryFolder folder;
  const auto config = read(folder, text, override_text);
  REQUIRE_FALSE(config);
  REQUIRE(config.error().exit_status() == 2);
  return config.error().message;
}

}  // namespace

TEST_CASE("node config: four keys are enough and paths are relative to the file") {
  const TemporaryFolder folder;
  const auto config = read(folder, kSmallest);
  REQUIRE(config);
  REQUIRE(config->site == "plant");
  REQUIRE(config->line == "L1");
  REQUIRE(config->rig == folder / "rig.toml");
  REQUIRE(config->zenoh.connect == std::vector<std::string>{"tcp/127.0.0.1:7447"});
  REQUIRE_FALSE(config->zenoh.router);
}

TEST_CASE("node config: what is printed reads back as the same config") {
  const TemporaryFolder folder;
  const auto config = read(folder, std::string(kSmallest) + "[health]\nperiod_s = 2\n", "capture.path=a \"b\"");
  REQUIRE(config);
  const auto again = read(folder, to_toml(*config));
  REQUIRE(again);
  REQUIRE(to_toml(*again) == to_toml(*config));
  REQUIRE(again->health_period_s == 2.0);
}

namespace {

constexpr const char* kCamera = R"(
[node]
camera_id = "cam1"
rig = "rig.toml"
[capture]
source = "v4l2"
[camera]
device = "/dev/video0"
width_px = 4656
height_px = 3520
format = "mono12"
trigger = "hardware"
exposure_us = 250.0
controls = ["gain=10", "test_pattern=0"]
)";

}  // namespace

TEST_CASE("node config: a camera's settings read, and read back as they are printed") {
  const TemporaryFolder folder;
  const auto config = read(folder, kCamera);
  REQUIRE(config);
  REQUIRE(config->camera.format == PixelFormat::mono12);
  REQUIRE(config->camera.trigger == CameraTrigger::hardware);
  REQUIRE(config->camera.controls.size() == 2);
  REQUIRE(config->camera.controls[1].name == "test_pattern");
  const auto again = read(folder, to_toml(*config));
  REQUIRE(again);
  REQUIRE(again->camera.exposure.time_us == 250.0);
  REQUIRE(to_toml(*again) == to_toml(*config));
}

TEST_CASE("node config: what a camera cannot be set to names its key") {
  const auto camera_fault = [](const std::string& key) { return fault(kCamera, key); };
  REQUIRE(camera_fault("camera.format=bayer").find("camera.format: pixel format \"bayer\"") != std::string::npos);
  REQUIRE(camera_fault("camera.height_px=0").find("width_px, height_px: expected both or neither") !=
          std::string::npos);
  REQUIRE(camera_fault("camera.recent_frames=5").find("recent_frames: expected 1 to 2") != std::string::npos);
  REQUIRE(camera_fault("camera.trigger=often").find("camera.trigger: ") != std::string::npos);
  REQUIRE(camera_fault("camera.controls=[\"gain\"]").find("expected name=value") != std::string::npos);
  REQUIRE(camera_fault("camera.buffers=1e99").find("camera.buffers: ") != std::string::npos);
  REQUIRE(camera_fault("capture.path=x").find("capture.path: a camera has none") != std::string::npos);
}

TEST_CASE("node config: a fault names the file, the line and the key") {
  REQUIRE(fault(std::string(kSmallest) + "[health]\nperiod_s = -1\n").find("node.toml:9: health.period_s: ") !=
          std::string::npos);
  REQUIRE(fault(std::string(kSmallest) + "[health]\nperiods = 1\n").find("node.toml:9: health.periods: unknown key") !=
          std::string::npos);
  REQUIRE(fault("[node]\nrig = \"r\"\n").find("node.camera_id: missing") != std::string::npos);
  REQUIRE(fault(std::string(kSmallest) + "[zenoh]\nconnect = [\"localhost\"]\n").find("zenoh.connect") !=
          std::string::npos);
}

TEST_CASE("node config: the exposure's limits are read, and those that make no sense are faults") {
  const TemporaryFolder folder;
  const auto config = read(folder, std::string(kSmallest) + "[exposure]\nauto = false\nmin_us = 50\nmax_us = 900\n" +
                                       "max_gain_db = 6\ntarget_level = 0.7\nmax_step = 2\n");
  REQUIRE(config);
  REQUIRE_FALSE(config->exposure.automatic);
  REQUIRE(config->exposure.min_time_us == 50.0);
  REQUIRE(config->exposure.max_time_us == 900.0);
  REQUIRE(config->exposure.max_gain_db == 6.0);
  REQUIRE(config->exposure.target_level == 0.7);
  REQUIRE(config->exposure.max_step == 2.0);
  const auto again = read(folder, to_toml(*config));
  REQUIRE(again);
  REQUIRE(to_toml(*again) == to_toml(*config));
  REQUIRE(fault(std::string(kSmallest) + "[exposure]\nmin_us = 900\nmax_us = 50\n").find("min_us, max_us: expected") !=
          std::string::npos);
  REQUIRE(fault(std::string(kSmallest) + "[exposure]\nauto = 3\n").find("exposure.auto") != std::string::npos);
}

TEST_CASE("node config: a forging at rest triggers nothing unless told to, and never in ready imprints") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(read(folder, kSmallest)->rest.trigger);
  const auto config = read(folder, std::string(kSmallest) + "[rest]\ntrigger = true\nmax_motion_px = 3.5\n");
  REQUIRE(config);
  REQUIRE(config->rest.trigger);
  REQUIRE(config->rest.max_motion_px == 3.5);
  REQUIRE(to_toml(*read(folder, to_toml(*config))) == to_toml(*config));
  REQUIRE(fault(std::string(kSmallest) + "[rest]\nhold_s = 0\n").find("hold_s: expected more than 0") !=
          std::string::npos);
  std::string replay = kSmallest;
  replay.replace(replay.find("\"folder\""), 8, "\"imprints\"");
  REQUIRE(fault(replay + "[rest]\ntrigger = true\n").find("rest.trigger: expected a source of pictures") !=
          std::string::npos);
}

TEST_CASE("node config: a fault of an override says that it is the command line's") {
  REQUIRE(fault(kSmallest, "node.method=sharpest").find("node.method: expected one of best") != std::string::npos);
  REQUIRE(fault(kSmallest, "health.period_s=0").find("--set: health.period_s") != std::string::npos);
  REQUIRE(fault(kSmallest, "node.site=../x").find("node.site") != std::string::npos);
}

}  // namespace imprint
