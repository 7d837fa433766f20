#include <catch2/catch.hpp>

#include "fusion/serve/alarm_list.h"
#include "fusion/serve/health_alarms.h"
#include "fusion/serve/line_board.h"
#include "fusion/serve/metrics.h"

namespace imprint {
namespace {

Health record(double temperature_c, double rms_px = 0.1) {
  Health health;
  health.camera_id = "cam1";
  health.version = "0.1.0";
  health.frames = 1;
  health.reprojection_rms_px = rms_px;
  health.contrast = 0.4;
  health.housing_temperature_c = temperature_c;
  return health;
}

}  // namespace

TEST_CASE("alarms: one that ended before anybody saw it stays until somebody has") {
  AlarmList alarms;
  alarms.set("store", "disk full", 1);
  alarms.set("store", "disk still full", 2);
  REQUIRE(alarms.standing().size() == 1);
  REQUIRE(alarms.standing()[0]["text"] == "disk still full");
  alarms.set("store", "", 3);
  REQUIRE_FALSE(alarms.any());
  REQUIRE(alarms.ended().size() == 1);
  REQUIRE(alarms.acknowledge("store", "otto", 4));
  REQUIRE(alarms.ended().empty());
  REQUIRE_FALSE(alarms.acknowledge("store", "otto", 5));
}

TEST_CASE("alarms: acknowledged, one stands on with the name of who saw it, and is gone with its cause") {
  AlarmList alarms;
  alarms.set("store", "disk full", 1);
  REQUIRE(alarms.acknowledge("store", "otto", 2));
  REQUIRE(alarms.any());
  REQUIRE(alarms.standing()[0]["acknowledged_by"] == "otto");
  alarms.set("store", "", 3);
  REQUIRE(alarms.ended().empty());
}

TEST_CASE("alarms: those that nobody ever sees stay few") {
  AlarmList alarms;
  for (int i = 0; i < 200; ++i) {
    alarms.set(std::to_string(i), "x", i);
    alarms.set(std::to_string(i), "", i);
  }
  REQUIRE(alarms.ended().size() == AlarmList::kMaxEnded);
  REQUIRE(alarms.ended().back()["name"] == "199");
}

TEST_CASE("health: a value that trembles at its limit makes one alarm, and only after three records") {
  HealthAlarms watch({});
  REQUIRE(watch.note(record(71)).empty());
  REQUIRE(watch.note(record(69)).empty());
  REQUIRE(watch.note(record(71)).empty());
  REQUIRE(watch.note(record(71)).empty());
  const auto begun = watch.note(record(71));
  REQUIRE(begun.size() == 1);
  REQUIRE(begun[0].name == "temperature_cam1");
  REQUIRE(begun[0].text == "camera cam1: temperature 71 C, limit 70");
  for (int i = 0; i < 10; ++i) REQUIRE(watch.note(record(i % 2 == 0 ? 69 : 71)).empty());  // not below 70 - 14
  REQUIRE(watch.note(record(50)).empty());
  REQUIRE(watch.note(record(50)).empty());
  const auto ended = watch.note(record(50));
  REQUIRE(ended.size() == 1);
  REQUIRE(ended[0].text.empty());
}

TEST_CASE("health: what is not known is no alarm, and a limit of 0 is none") {
  HealthAlarms watch({.max_temperature_c = 0.0, .max_reprojection_px = 1.0});
  Health before_any_frame = record(99, 5.0);
  before_any_frame.frames = 0;
  for (int i = 0; i < 5; ++i) REQUIRE(watch.note(before_any_frame).empty());
  for (int i = 0; i < 2; ++i) REQUIRE(watch.note(record(99, 5.0)).empty());
  REQUIRE(watch.note(record(99, 5.0))[0].name == "reprojection_cam1");
}

TEST_CASE("metrics: every camera, counter and alarm in Prometheus' form, nothing for what is not known") {
  LineBoard board({"plant", "L1", "best", "0.1.0"}, {"cam1", "cam2"}, LineBoard::Time{});
  board.set_health(record(41), LineBoard::Time{});
  board.set_alarm("odd", "x");
  board.count("late", 3);
  const std::string text = prometheus_text(board.status(LineBoard::Time{}));
  const auto has = [&](const std::string& line) { return text.find(line + "\n") != std::string::npos; };
  REQUIRE(has("# TYPE imprint_events_total counter"));
  REQUIRE(has(R"(imprint_events_total{site="plant",line="L1",event="late"} 3)"));
  REQUIRE(has(R"(imprint_camera_connected{site="plant",line="L1",camera="cam2"} 0)"));
  REQUIRE(has(R"(imprint_camera_housing_temperature_celsius{site="plant",line="L1",camera="cam1"} 41.0)"));
  REQUIRE(has(R"(imprint_camera_version_info{site="plant",line="L1",camera="cam1",version="0.1.0"} 1)"));
  REQUIRE(has(R"(imprint_alarm{site="plant",line="L1",alarm="odd",acknowledged="no"} 1)"));
  REQUIRE(text.find("sensor_temperature_celsius{") == std::string::npos);
  for (std::size_t begin = 0; begin < text.size(); begin = text.find('\n', begin) + 1)
    REQUIRE((text.compare(begin, 2, "# ") == 0 || text.compare(begin, 8, "imprint_") == 0));
}

}  // namespace imprint
