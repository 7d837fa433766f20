#include "fusion/serve/line_board.h"

#include <catch2/catch.hpp>

namespace imprint {
namespace {

using Time = LineBoard::Time;
const Time kStart = Time(std::chrono::hours(1));

}  // namespace

TEST_CASE("board: a camera that was never heard of is there, not connected and without figures") {
  const LineBoard empty({"plant", "L1", "best", "0.1.0"}, {"cam1", "cam2"}, kStart);
  const auto status = empty.status(kStart + std::chrono::seconds(5));
  REQUIRE(status["schema"] == "imprint.status/1");
  REQUIRE(status["uptime_s"] == 5.0);
  REQUIRE(status["cameras"].size() == 2);
  REQUIRE(status["cameras"][1]["id"] == "cam2");
  REQUIRE(status["cameras"][1]["alive"] == false);
  REQUIRE(status["cameras"][1]["health"].is_null());
  REQUIRE(status["session"].is_null());
  REQUIRE(status["last_result"].is_null());
  REQUIRE(status["counters"]["imprints"] == 0);
}

TEST_CASE("board: health and imprints show with their age; those of unknown cameras do not") {
  LineBoard line({"plant", "L1", "best", "0.1.0"}, {"cam1", "cam2"}, kStart);
  Health health;
  health.camera_id = "cam1";
  health.boot_id = 0xFEDCBA9876543210ULL;
  health.targets_seen = 12;
  line.set_health(health, kStart + std::chrono::seconds(1));
  health.camera_id = "cam9";
  line.set_health(health, kStart);
  Imprint imprint;
  imprint.camera_id = "cam2";
  imprint.failure = "no forging found";
  imprint.upper.offset_px.assign(500, 1.0);
  line.note_imprint(imprint, kStart + std::chrono::seconds(2));
  line.set_alive("cam1", true);
  line.set_alive("cam9", true);
  const auto status = line.status(kStart + std::chrono::seconds(4));
  REQUIRE(status["cameras"].size() == 2);
  REQUIRE(status["cameras"][0]["alive"] == true);
  REQUIRE(status["cameras"][0]["health"]["age_s"] == 3.0);
  REQUIRE(status["cameras"][0]["health"]["boot_id"] == "fedcba9876543210");
  REQUIRE(status["cameras"][1]["last_imprint"]["failure"] == "no forging found");
  REQUIRE(status["cameras"][1]["last_imprint"]["age_s"] == 2.0);
}

TEST_CASE("board: the last result is shown without its sections, so that the status stays small") {
  auto line = std::make_unique<LineBoard>(LineBoard::Identity{}, std::vector<std::string>{}, kStart);
  line->set_result({"S", true, "", R"({"length_mm": 1500.0, "sections": [1, 2, 3]})", 0, 7});
  const auto last = line->status(kStart)["last_result"];
  REQUIRE(last["revision"] == 7);
  REQUIRE(last["result"]["length_mm"] == 1500.0);
  REQUIRE_FALSE(last["result"].contains("sections"));
}

namespace {

TEST_CASE("board: what a camera says of its exposure is an alarm until it no longer says so") {
  LineBoard line({"plant", "L1", "best", "0.1.0"}, {"cam1", "cam2"}, kStart);
  Health health;
  health.camera_id = "cam1";
  health.exposure_alarm = "cannot hold the body out of saturation: exposure at its minimum 20 us";
  health.haze_px = 0.25;
  line.set_health(health, kStart);
  const auto status = line.status(kStart);
  REQUIRE(status["alarms"].size() == 1);
  REQUIRE(status["alarms"][0]["name"] == "exposure_cam1");
  REQUIRE(status["alarms"][0]["text"] ==
          "camera cam1: cannot hold the body out of saturation: exposure at its minimum 20 us");
  REQUIRE(status["cameras"][0]["health"]["haze_px"] == 0.25);
  health.exposure_alarm.clear();
  line.set_health(health, kStart);
  REQUIRE_FALSE(line.has_alarm());
}

TEST_CASE("board: a camera that gives no frames is an alarm until frames come") {
  LineBoard line({"plant", "L1", "best", "0.1.0"}, {"cam1", "cam2"}, kStart);
  Health health;
  health.camera_id = "cam1";
  health.capture_fault = "/dev/video0: lost: No such device";
  health.dropped_frames = 7;
  line.set_health(health, kStart);
  const auto status = line.status(kStart);
  REQUIRE(status["alarms"].size() == 1);
  REQUIRE(status["alarms"][0]["name"] == "capture_cam1");
  REQUIRE(status["alarms"][0]["text"] == "camera cam1: /dev/video0: lost: No such device");
  REQUIRE(status["cameras"][0]["health"]["dropped_frames"] == 7);
  health.capture_fault.clear();
  line.set_health(health, kStart);
  REQUIRE_FALSE(line.has_alarm());
}

Health health_of(std::uint64_t boot_id, std::int64_t sent_s) {
  Health health;
  health.camera_id = "cam1";
  health.boot_id = boot_id;
  health.time_ns = sent_s * 1'000'000'000;
  return health;
}

}  // namespace

TEST_CASE("board: a node that was started anew is no second node") {
  LineBoard line({}, {"cam1"}, kStart);
  for (int boot = 1; boot <= 40; ++boot) {  // more often than boot ids are kept
    for (int i = 0; i < 3; ++i) {
      const int second = 10 * boot + i;
      REQUIRE_FALSE(
          line.set_health(health_of(static_cast<std::uint64_t>(boot), second), kStart + std::chrono::seconds(second)));
    }
  }
  REQUIRE_FALSE(line.has_alarm());
}

TEST_CASE("board: a record of the former start that comes late is no second node") {
  LineBoard line({}, {"cam1"}, kStart);
  line.set_health(health_of(1, 5), kStart);
  line.set_health(health_of(2, 9), kStart);
  REQUIRE_FALSE(line.set_health(health_of(1, 4), kStart));
  REQUIRE_FALSE(line.has_alarm());
}

TEST_CASE("board: two nodes under one name raise an alarm once, until one has been gone for two minutes") {
  LineBoard line({}, {"cam1"}, kStart);
  line.set_health(health_of(1, 0), kStart);
  REQUIRE_FALSE(line.set_health(health_of(2, 1), kStart));
  const auto raised = line.set_health(health_of(1, 5), kStart);
  REQUIRE(raised);
  REQUIRE(raised->find("camera cam1: two nodes") == 0);
  REQUIRE(raised->find("0000000000000002") != std::string::npos);
  REQUIRE(line.status(kStart)["alarms"][0]["name"] == "two_nodes_cam1");
  REQUIRE_FALSE(line.set_health(health_of(2, 6), kStart + std::chrono::seconds(1)));
  line.set_health(health_of(2, 11), kStart + std::chrono::seconds(100));
  REQUIRE(line.has_alarm());
  line.set_health(health_of(2, 16), kStart + std::chrono::seconds(121));
  REQUIRE_FALSE(line.has_alarm());
}

TEST_CASE("board: an alarm stands until it is over") {
  LineBoard line({}, {}, kStart);
  line.set_alarm("store", "disk full");
  REQUIRE(line.has_alarm());
  REQUIRE(line.status(kStart)["alarms"][0]["text"] == "disk full");
  line.set_alarm("store", "");
  REQUIRE_FALSE(line.has_alarm());
}

}  // namespace imprint
