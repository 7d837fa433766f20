#include "node/camera_section.h"

#include <algorithm>
#include <limits>

#include "lib/daemon/program.h"

namespace imprint {
namespace {

int read_count(TomlReader& read, std::string_view key, int fallback) {
  const std::int64_t value = read.integer(key, fallback);
  if (value >= std::numeric_limits<int>::min() && value <= std::numeric_limits<int>::max())
    return static_cast<int>(value);
  read.fault(key, fmt::format("too large: {}", value));
  return fallback;
}

PixelFormat read_format(TomlReader& read, PixelFormat fallback) {
  const auto format = pixel_format_from_name(read.string("camera.format", std::string(name_of(fallback))));
  if (format) return *format;
  read.fault("camera.format", format.error().message);
  return fallback;
}

CameraTrigger read_trigger(TomlReader& read, CameraTrigger fallback) {
  const std::string name = read_choice(read, "camera.trigger", kCameraTriggers,
                                       std::string(kCameraTriggers.at(static_cast<std::size_t>(fallback))));
  const auto* const found = std::ranges::find(kCameraTriggers, name);
  return found == kCameraTriggers.end() ? fallback : static_cast<CameraTrigger>(found - kCameraTriggers.begin());
}

std::vector<CameraControl> read_controls(TomlReader& read) {
  std::vector<CameraControl> controls;
  for (const std::string& text : read.strings("camera.controls", std::vector<std::string>{})) {
    if (auto control = camera_control_from_text(text)) {
      controls.push_back(std::move(*control));
    } else {
      read.fault("camera.controls", control.error().message);
    }
  }
  return controls;
}

std::string controls_text(const std::vector<CameraControl>& controls) {
  std::vector<std::string> texts;
  for (const CameraControl& control : controls) texts.push_back(control.name + "=" + control.value);
  return toml_list(texts);
}

}  // namespace

CameraSettings read_camera_section(TomlReader& read) {
  CameraSettings camera;
  camera.device = read.string("camera.device", camera.device);
  camera.width_px = read_count(read, "camera.width_px", camera.width_px);
  camera.height_px = read_count(read, "camera.height_px", camera.height_px);
  camera.format = read_format(read, camera.format);
  camera.input = read_count(read, "camera.input", camera.input);
  camera.frames_per_s = read.number("camera.frames_per_s", camera.frames_per_s);
  camera.trigger = read_trigger(read, camera.trigger);
  camera.buffers = read_count(read, "camera.buffers", camera.buffers);
  camera.recent_frames = read_count(read, "camera.recent_frames", camera.recent_frames);
  camera.exposure.time_us = read.number("camera.exposure_us", camera.exposure.time_us);
  camera.exposure.gain_db = read.number("camera.gain_db", camera.exposure.gain_db);
  camera.exposure_control = read.string("camera.exposure_control", camera.exposure_control);
  camera.exposure_unit_us = read.number("camera.exposure_unit_us", camera.exposure_unit_us);
  camera.gain_control = read.string("camera.gain_control", camera.gain_control);
  camera.gain_unit_db = read.number("camera.gain_unit_db", camera.gain_unit_db);
  camera.controls = read_controls(read);
  camera.stall_s = read.number("camera.stall_s", camera.stall_s);
  camera.packet_bytes = read_count(read, "camera.packet_bytes", camera.packet_bytes);
  camera.socket_buffer_mb = read.number("camera.socket_buffer_mb", camera.socket_buffer_mb);
  if (const auto valid = camera.validate(); !valid) read.fault("camera", valid.error().message);
  return camera;
}

std::string camera_to_toml(const CameraSettings& camera) {
  return fmt::format(
      "[camera]\ndevice = {}\nwidth_px = {}\nheight_px = {}\nformat = {}\ninput = {}\nframes_per_s = {}\n"
      "trigger = {}\nbuffers = {}\nrecent_frames = {}\nexposure_us = {}\ngain_db = {}\nexposure_control = {}\n"
      "exposure_unit_us = {}\ngain_control = {}\ngain_unit_db = {}\ncontrols = {}\nstall_s = {}\npacket_bytes = {}\n"
      "socket_buffer_mb = {}\n",
      toml_text(camera.device), camera.width_px, camera.height_px, toml_text(name_of(camera.format)), camera.input,
      toml_number(camera.frames_per_s), toml_text(kCameraTriggers.at(static_cast<std::size_t>(camera.trigger))),
      camera.buffers, camera.recent_frames, toml_number(camera.exposure.time_us), toml_number(camera.exposure.gain_db),
      toml_text(camera.exposure_control), toml_number(camera.exposure_unit_us), toml_text(camera.gain_control),
      toml_number(camera.gain_unit_db), controls_text(camera.controls), toml_number(camera.stall_s),
      camera.packet_bytes, toml_number(camera.socket_buffer_mb));
}

}  // namespace imprint
