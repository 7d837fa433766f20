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

TEST_CASE("board: an alarm stands until it is over") {
  LineBoard line({}, {}, kStart);
  line.set_alarm("store", "disk full");
  REQUIRE(line.has_alarm());
  REQUIRE(line.status(kStart)["alarms"][0]["text"] == "disk full");
  line.set_alarm("store", "");
  REQUIRE_FALSE(line.has_alarm());
}

}  // namespace imprint
