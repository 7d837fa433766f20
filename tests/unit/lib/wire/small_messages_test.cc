#include <catch2/catch.hpp>

#include <limits>

#include "lib/wire/wire.h"
#include "lib/wire/wire_text.h"

using namespace imprint;

TEST_CASE("trigger message: comes back whole") {
  const Trigger sent{"heat-0417", 2, 90.5, 1795370000123456789, 3};
  const auto got = decode_trigger(encode_trigger(sent));
  REQUIRE(got);
  CHECK(got->session == sent.session);
  CHECK(got->observation == sent.observation);
  CHECK(got->rotation_deg == sent.rotation_deg);
  CHECK(got->fire_at_ns == sent.fire_at_ns);
  CHECK(got->observations_expected == sent.observations_expected);
}

TEST_CASE("trigger message: a session that cannot be a key is refused") {
  for (const char* session : {"", "a/b", "*", "..", "heat 7"}) {
    const auto got = decode_trigger(encode_trigger({session, 0, 0.0, 0, 0}));
    REQUIRE_FALSE(got);
    CHECK(got.error().message.find("trigger: session id: expected") == 0);
  }
  CHECK_FALSE(decode_trigger(encode_trigger({"a", 0, std::numeric_limits<double>::infinity(), 0, 0})));
}

TEST_CASE("health message: comes back whole in about 130 bytes") {
  Health sent{"cam2",
              1795370000123456789,
              0x123456789abcdef0,
              4711,
              4800,
              89,
              31,
              0.127,
              0.41,
              "frame 4800: 2 targets found, 4 needed",
              "0.1.0",
              imprint::PoseState::hold};
  sent.saturated_fraction = 0.012, sent.blur_px = 0.84, sent.haze_px = 0.13, sent.body_level = 0.81;
  sent.exposure_us = 740.0, sent.gain_db = 3.0;
  const auto bytes = encode_health(sent);
  WARN("health: " << bytes.size() << " bytes");
  CHECK(bytes.size() <= 135);
  const auto got = decode_health(bytes);
  REQUIRE(got);
  CHECK(got->camera_id == sent.camera_id);
  CHECK(got->time_ns == sent.time_ns);
  CHECK(got->boot_id == sent.boot_id);
  CHECK(got->sequence == sent.sequence);
  CHECK(got->frames == sent.frames);
  CHECK(got->failed_frames == sent.failed_frames);
  CHECK(got->targets_seen == sent.targets_seen);
  CHECK(got->reprojection_rms_px == Approx(sent.reprojection_rms_px).epsilon(1e-7));  // float
  CHECK(got->contrast == Approx(sent.contrast).epsilon(1e-7));
  CHECK(got->last_error == sent.last_error);
  CHECK(got->version == sent.version);
  CHECK(got->pose_state == imprint::PoseState::hold);
  CHECK(got->saturated_fraction == Approx(sent.saturated_fraction).epsilon(1e-7));
  CHECK(got->blur_px == Approx(sent.blur_px).epsilon(1e-7));
  CHECK(got->haze_px == Approx(sent.haze_px).epsilon(1e-7));
  CHECK(got->body_level == Approx(sent.body_level).epsilon(1e-7));
  CHECK(got->exposure_us == Approx(sent.exposure_us).epsilon(1e-7));
  CHECK(got->gain_db == Approx(sent.gain_db).epsilon(1e-7));
  CHECK(got->exposure_alarm.empty());
}

TEST_CASE("health message: a long error is cut to 80 bytes") {
  Health sent;
  sent.camera_id = "cam1";
  sent.last_error = std::string(200, 'e');
  const auto got = decode_health(encode_health(sent));
  REQUIRE(got);
  CHECK(got->last_error == std::string(77, 'e') + "...");
}

TEST_CASE("receipt, delivery and rest messages: come back whole, long reasons cut") {
  const Receipt receipt{"cam1", 0xFEDCBA9876543210, 12, std::string(300, 'r')};
  const auto confirmed = decode_receipt(encode_receipt(receipt));
  REQUIRE(confirmed);
  CHECK(confirmed->camera_id == "cam1");
  CHECK(confirmed->boot_id == receipt.boot_id);
  CHECK(confirmed->sequence == 12);
  CHECK(confirmed->refused == std::string(237, 'r') + "...");
  CHECK(encode_receipt({"cam1", ~0ULL, 1'000'000, ""}).size() < 32);  // one an imprint

  const auto told = decode_delivery(encode_delivery({"cam1", -5, 7, 12, 9, 3, 12'288, 1, 2, "no space left"}));
  REQUIRE(told);
  CHECK(told->time_ns == -5);
  CHECK(told->boot_id == 7);
  CHECK(told->sequence == 12);
  CHECK(told->oldest_waiting == 9);
  CHECK(told->waiting == 3);
  CHECK(told->waiting_bytes == 12'288);
  CHECK(told->discarded == 1);
  CHECK(told->refused == 2);
  CHECK(told->fault == "no space left");
  const auto rest = decode_rest(encode_rest({"cam1", 123'456'789'012}));
  REQUIRE(rest);
  CHECK(rest->camera_id == "cam1");
  CHECK(rest->time_ns == 123'456'789'012);
  CHECK_FALSE(decode_rest(encode_rest({"no id", 0})));
  CHECK_FALSE(decode_receipt(std::vector<std::uint8_t>{0x10}));
  CHECK_FALSE(decode_delivery(encode_delivery({"no id", 0, 0, 0, 0, 0, 0, 0, 0, ""})));
}

TEST_CASE("health message: an alarm of the exposure comes back, what is not finite is sent as 0") {
  Health sent;
  sent.camera_id = "cam1";
  sent.exposure_alarm = "cannot hold the body out of saturation: exposure at its minimum 20 us";
  sent.haze_px = std::numeric_limits<double>::quiet_NaN();
  const auto got = decode_health(encode_health(sent));
  REQUIRE(got);
  CHECK(got->exposure_alarm == sent.exposure_alarm);
  CHECK(got->haze_px == 0.0);
}

TEST_CASE("health message: what a camera lost and why comes back") {
  Health sent;
  sent.camera_id = "cam1";
  sent.dropped_frames = 1'000'000'000'000;
  sent.capture_restarts = 3;
  sent.capture_fault = "/dev/video0: lost: No such device";
  const auto got = decode_health(encode_health(sent));
  REQUIRE(got);
  CHECK(got->dropped_frames == sent.dropped_frames);
  CHECK(got->capture_restarts == 3);
  CHECK(got->capture_fault == sent.capture_fault);
}

TEST_CASE("result message: comes back whole") {
  const ResultMessage sent{"heat-0417", true, "", R"({"schema": "imprint.result/1", "warnings": ["čidlo"]})"};
  const auto got = decode_result(encode_result(sent));
  REQUIRE(got);
  CHECK(got->session == sent.session);
  CHECK(got->complete == sent.complete);
  CHECK(got->error == sent.error);
  CHECK(got->json == sent.json);
}

TEST_CASE("small messages: damaged bytes are refused or decode, and never crash") {
  const auto health = encode_health({"cam2", 1, 2, 3, 4, 5, 6, 0.1, 0.2, "error", "0.1.0"});
  for (std::size_t length = 0; length < health.size(); ++length) {
    (void)decode_health(std::span(health).first(length));
    (void)decode_trigger(std::span(health).first(length));
    (void)decode_result(std::span(health).first(length));
  }
  CHECK_FALSE(decode_health({}));
  CHECK_FALSE(decode_trigger({}));
  CHECK_FALSE(decode_result({}));
}

TEST_CASE("wire text: only well-formed UTF-8 passes") {
  CHECK(valid_utf8("průvis 1 200 °C ✓ 🔥") == "průvis 1 200 °C ✓ 🔥");
  CHECK(valid_utf8("\xc0\x80") == "??");            // overlong
  CHECK(valid_utf8("\xed\xa0\x80") == "???");       // surrogate
  CHECK(valid_utf8("\xf4\x90\x80\x80") == "????");  // beyond U+10FFFF
  CHECK(valid_utf8("a\xe2\x9c") == "a??");          // cut
  CHECK(wire_line("✓✓✓", 9) == "✓✓✓");
  CHECK(wire_line("✓✓✓✓", 9) == "✓✓...");
  CHECK(wire_line("abc", 2) == "..");
}
