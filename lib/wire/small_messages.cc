#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include <google/protobuf/stubs/logging.h>

#include "health.pb.h"
#include "imprint.pb.h"
#include "lib/wire/keys.h"
#include "lib/wire/message_bytes.h"
#include "lib/wire/wire.h"
#include "lib/wire/wire_text.h"

namespace imprint {
namespace {

constexpr std::uint32_t kSchemaVersion = 1;
constexpr std::size_t kMaxSmallBytes = 4096;
constexpr std::size_t kMaxResultBytes = std::size_t{16} << 20;  // 500 sections take about 0.15 MB
constexpr std::size_t kMaxErrorBytes = 80;
constexpr std::size_t kMaxAlarmBytes = 120;
constexpr std::size_t kMaxVersionBytes = 32;
constexpr std::size_t kMaxResultErrorBytes = 1000;

// Rounded, and held within what the field can carry.
template <class Integer>
Integer whole(double value) {
  using Limits = std::numeric_limits<Integer>;
  if (!(value > static_cast<double>(Limits::min()))) return Limits::min();
  if (value >= static_cast<double>(Limits::max())) return Limits::max();
  return static_cast<Integer>(std::llround(value));
}

}  // namespace

void silence_protobuf() {
  static std::once_flag once;
  std::call_once(once, [] { google::protobuf::SetLogHandler(nullptr); });
}

std::vector<std::uint8_t> encode_trigger(const Trigger& trigger) {
  v1::Trigger message;
  message.set_schema_version(kSchemaVersion);
  message.set_session(wire_line(trigger.session, kMaxIdBytes));
  message.set_observation(trigger.observation);
  message.set_rotation_deg(trigger.rotation_deg);
  message.set_fire_at_ns(trigger.fire_at_ns);
  message.set_observations_expected(trigger.observations_expected);
  return bytes_of(message);
}

Result<Trigger> decode_trigger(std::span<const std::uint8_t> bytes) {
  const auto message = parse_message<v1::Trigger>(bytes, kMaxSmallBytes);
  if (!message) return invalid_input("trigger: {}", message.error().message);
  if (auto checked = check_id("session", message->session()); !checked)
    return invalid_input("trigger: {}", checked.error().message);
  if (!std::isfinite(message->rotation_deg())) return invalid_input("trigger: rotation_deg: expected a finite value");
  return Trigger{message->session(), message->observation(), message->rotation_deg(), message->fire_at_ns(),
                 message->observations_expected()};
}

std::vector<std::uint8_t> encode_health(const Health& health) {
  v1::Health message;
  message.set_schema_version(kSchemaVersion);
  message.set_camera_id(wire_line(health.camera_id, kMaxIdBytes));
  message.set_time_ns(health.time_ns);
  message.set_boot_id(health.boot_id);
  message.set_sequence(health.sequence);
  message.set_frames(health.frames);
  message.set_failed_frames(health.failed_frames);
  message.set_targets_seen(wire_count(health.targets_seen));
  message.set_reprojection_rms_px(wire_float(health.reprojection_rms_px));
  message.set_contrast(wire_float(health.contrast));
  message.set_last_error(wire_line(health.last_error, kMaxErrorBytes));
  message.set_version(wire_line(health.version, kMaxVersionBytes));
  message.set_pose_state(static_cast<std::uint32_t>(health.pose_state));
  message.set_saturated_fraction(wire_float(health.saturated_fraction));
  message.set_blur_px(wire_float(health.blur_px));
  message.set_haze_px(wire_float(health.haze_px));
  message.set_body_level(wire_float(health.body_level));
  message.set_exposure_us(wire_float(health.exposure_us));
  message.set_gain_db(wire_float(health.gain_db));
  if (health.housing_temperature_c)
    message.set_housing_temperature_c(whole<std::int32_t>(*health.housing_temperature_c));
  if (health.sensor_temperature_c) message.set_sensor_temperature_c(whole<std::int32_t>(*health.sensor_temperature_c));
  if (health.storage_free_mb) message.set_storage_free_mb(whole<std::uint32_t>(*health.storage_free_mb));
  if (health.clock_offset_s) message.set_clock_offset_ms(whole<std::int64_t>(1000.0 * *health.clock_offset_s));
  message.set_exposure_alarm(wire_line(health.exposure_alarm, kMaxAlarmBytes));
  message.set_dropped_frames(health.dropped_frames);
  message.set_capture_restarts(static_cast<std::uint32_t>(
      std::min<std::uint64_t>(health.capture_restarts, std::numeric_limits<std::uint32_t>::max())));
  message.set_capture_fault(wire_line(health.capture_fault, kMaxErrorBytes));
  return bytes_of(message);
}

Result<Health> decode_health(std::span<const std::uint8_t> bytes) {
  const auto message = parse_message<v1::Health>(bytes, kMaxSmallBytes);
  if (!message) return invalid_input("health: {}", message.error().message);
  if (auto checked = check_id("camera", message->camera_id()); !checked)
    return invalid_input("health: {}", checked.error().message);
  for (const float value :
       {message->reprojection_rms_px(), message->contrast(), message->saturated_fraction(), message->blur_px(),
        message->haze_px(), message->body_level(), message->exposure_us(), message->gain_db()})
    if (!std::isfinite(value))
      return invalid_input("health of camera '{}': expected finite values", message->camera_id());
  Health health;
  health.camera_id = message->camera_id();
  health.time_ns = message->time_ns();
  health.boot_id = message->boot_id();
  health.sequence = message->sequence();
  health.frames = message->frames();
  health.failed_frames = message->failed_frames();
  health.targets_seen = read_count(message->targets_seen());
  health.reprojection_rms_px = message->reprojection_rms_px();
  health.contrast = message->contrast();
  health.last_error = message->last_error();
  health.version = message->version();
  health.pose_state = pose_state_from(static_cast<int>(std::min(message->pose_state(), 3U)));
  health.saturated_fraction = message->saturated_fraction();
  health.blur_px = message->blur_px();
  health.haze_px = message->haze_px();
  health.body_level = message->body_level();
  health.exposure_us = message->exposure_us();
  health.gain_db = message->gain_db();
  if (message->has_housing_temperature_c()) health.housing_temperature_c = message->housing_temperature_c();
  if (message->has_sensor_temperature_c()) health.sensor_temperature_c = message->sensor_temperature_c();
  if (message->has_storage_free_mb()) health.storage_free_mb = message->storage_free_mb();
  if (message->has_clock_offset_ms()) health.clock_offset_s = 0.001 * static_cast<double>(message->clock_offset_ms());
  health.exposure_alarm = message->exposure_alarm();
  health.dropped_frames = message->dropped_frames();
  health.capture_restarts = message->capture_restarts();
  health.capture_fault = message->capture_fault();
  return health;
}

std::vector<std::uint8_t> encode_result(const ResultMessage& result) {
  v1::Result message;
  message.set_schema_version(kSchemaVersion);
  message.set_session(wire_line(result.session, kMaxIdBytes));
  message.set_complete(result.complete);
  message.set_error(wire_line(result.error, kMaxResultErrorBytes));
  message.set_json(valid_utf8(result.json));
  return bytes_of(message);
}

Result<ResultMessage> decode_result(std::span<const std::uint8_t> bytes) {
  auto message = parse_message<v1::Result>(bytes, kMaxResultBytes);
  if (!message) return invalid_input("result: {}", message.error().message);
  if (auto checked = check_id("session", message->session()); !checked)
    return invalid_input("result: {}", checked.error().message);
  return ResultMessage{message->session(), message->complete(), message->error(), std::move(*message->mutable_json())};
}

}  // namespace imprint
