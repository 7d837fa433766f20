#include "node/node_config.h"

#include <algorithm>
#include <vector>

#include "lib/daemon/program.h"
#include "node/camera_section.h"
#include "node/capture/frame_source.h"
#include "node/service/thermometer.h"

namespace imprint {
namespace {

// Pictures that are there, cameras, and ready imprints in place of frames.
std::vector<std::string_view> known_sources() {
  std::vector<std::string_view> sources(kFrameSources.begin(), kFrameSources.end());
  // One by one: of insert() GCC 12 for arm64 warns falsely (-Warray-bounds).
  for (const std::string_view source : camera_sources()) sources.push_back(source);
  sources.emplace_back("imprints");
  return sources;
}

ExposureConfig read_exposure(TomlReader& read) {
  ExposureConfig config;
  config.automatic = read.boolean("exposure.auto", config.automatic);
  config.min_time_us = read.number("exposure.min_us", config.min_time_us);
  config.max_time_us = read.number("exposure.max_us", config.max_time_us);
  config.max_gain_db = read.number("exposure.max_gain_db", config.max_gain_db);
  config.target_level = read.number("exposure.target_level", config.target_level);
  config.max_step = read.number("exposure.max_step", config.max_step);
  if (const auto valid = config.validate(); !valid) read.fault("exposure", valid.error().message);
  return config;
}

RestConfig read_rest(TomlReader& read) {
  RestConfig config;
  config.trigger = read.boolean("rest.trigger", config.trigger);
  config.period_ms = read.number("rest.period_ms", config.period_ms);
  config.max_motion_px = read.number("rest.max_motion_px", config.max_motion_px);
  config.hold_s = read.number("rest.hold_s", config.hold_s);
  config.rearm_px = read.number("rest.rearm_px", config.rearm_px);
  if (const auto valid = config.validate(); !valid) read.fault("rest", valid.error().message);
  return config;
}

std::string to_toml(const RestConfig& config) {
  return fmt::format("[rest]\ntrigger = {}\nperiod_ms = {}\nmax_motion_px = {}\nhold_s = {}\nrearm_px = {}\n",
                     config.trigger, toml_number(config.period_ms), toml_number(config.max_motion_px),
                     toml_number(config.hold_s), toml_number(config.rearm_px));
}

std::string read_thermometer(TomlReader& read, std::string_view key) {
  std::string source = read.string(key, "");
  if (const auto opened = Thermometer::open(source); !opened) read.fault(key, opened.error().message);
  return source;
}

}  // namespace

Result<NodeConfig> read_node_config(const std::filesystem::path& path, const toml::table& table) {
  NodeConfig config;
  TomlReader read(path, table);
  read.only({"node.site",
             "node.line",
             "node.camera_id",
             "node.rig",
             "node.method",
             "node.log_level",
             "capture.source",
             "capture.path",
             "camera.device",
             "camera.width_px",
             "camera.height_px",
             "camera.format",
             "camera.input",
             "camera.frames_per_s",
             "camera.trigger",
             "camera.buffers",
             "camera.recent_frames",
             "camera.exposure_us",
             "camera.gain_db",
             "camera.exposure_control",
             "camera.exposure_unit_us",
             "camera.gain_control",
             "camera.gain_unit_db",
             "camera.controls",
             "camera.stall_s",
             "camera.packet_bytes",
             "camera.socket_buffer_mb",
             "exposure.auto",
             "exposure.min_us",
             "exposure.max_us",
             "exposure.max_gain_db",
             "exposure.target_level",
             "exposure.max_step",
             "zenoh.connect",
             "zenoh.listen",
             "zenoh.identity",
             "zenoh.insecure",
             "health.period_s",
             "health.housing_temperature",
             "health.sensor_temperature",
             "node.data_dir",
             "spool.max_mb",
             "spool.retry_s",
             "rest.trigger",
             "rest.period_ms",
             "rest.max_motion_px",
             "rest.hold_s",
             "rest.rearm_px"});
  config.site = read_id(read, "node.site", config.site);
  config.line = read_id(read, "node.line", config.line);
  config.camera_id = read_id(read, "node.camera_id", std::nullopt);
  config.rig = read.path("node.rig");
  config.method = read_choice(read, "node.method", kMethods, config.method);
  config.log_level = read_choice(read, "node.log_level", kLogLevels, config.log_level);
  config.capture_source = read_choice(read, "capture.source", known_sources(), std::nullopt);
  if (has_camera(config)) {
    config.camera = read_camera_section(read);
    if (read.has("capture.path")) read.fault("capture.path", "a camera has none; camera.device names it");
  } else {
    config.capture_path = read.path("capture.path");
  }
  config.exposure = read_exposure(read);
  config.zenoh = read_zenoh_section(read, config.zenoh);
  config.health_period_s = read.number("health.period_s", config.health_period_s);
  if (!(config.health_period_s >= 0.1 && config.health_period_s <= 3600.0)) {
    read.fault("health.period_s", fmt::format("expected 0.1 to 3600 s, found {}", config.health_period_s));
  }
  config.housing_temperature = read_thermometer(read, "health.housing_temperature");
  config.sensor_temperature = read_thermometer(read, "health.sensor_temperature");
  config.data_dir = read.path("node.data_dir", std::filesystem::absolute(path).parent_path() / "imprint-data");
  config.spool_max_mb = read.integer("spool.max_mb", config.spool_max_mb);
  if (config.spool_max_mb < 1 || config.spool_max_mb > 1'000'000) {
    read.fault("spool.max_mb", fmt::format("expected 1 to 1000000 MB, found {}", config.spool_max_mb));
  }
  config.retry_s = read.number("spool.retry_s", config.retry_s);
  if (!(config.retry_s >= 0.1 && config.retry_s <= 60.0)) {
    read.fault("spool.retry_s", fmt::format("expected 0.1 to 60 s, found {}", config.retry_s));
  }
  config.rest = read_rest(read);
  if (config.rest.trigger && config.capture_source == "imprints")
    read.fault("rest.trigger", "expected a source of pictures: in ready imprints nothing can be seen to move");
  if (config.zenoh.connect.empty() && config.zenoh.listen.empty()) {
    read.fault("zenoh.connect", "no endpoint here nor in zenoh.listen: fusion could not be reached");
  }
  if (const auto error = read.error()) return pass_on(*error);
  return config;
}

bool has_camera(const NodeConfig& config) {
  return std::ranges::find(camera_sources(), config.capture_source) != camera_sources().end();
}

std::string to_toml(const NodeConfig& config) {
  const std::string where = has_camera(config) ? "\n" + camera_to_toml(config.camera)
                                               : fmt::format("path = {}\n", toml_text(config.capture_path.string()));
  return fmt::format(
      "[node]\nsite = {}\nline = {}\ncamera_id = {}\nrig = {}\nmethod = {}\nlog_level = {}\n"
      "data_dir = {}\n\n[spool]\nmax_mb = {}\nretry_s = {}\n\n[capture]\nsource = {}\n{}\n"
      "[exposure]\nauto = {}\nmin_us = {}\nmax_us = {}\nmax_gain_db = {}\ntarget_level = {}\nmax_step = {}\n\n"
      "[zenoh]\n{}\n[health]\nperiod_s = {}\nhousing_temperature = {}\nsensor_temperature = {}\n\n{}",
      toml_text(config.site), toml_text(config.line), toml_text(config.camera_id), toml_text(config.rig.string()),
      toml_text(config.method), toml_text(config.log_level), toml_text(config.data_dir.string()), config.spool_max_mb,
      toml_number(config.retry_s), toml_text(config.capture_source), where, config.exposure.automatic,
      toml_number(config.exposure.min_time_us), toml_number(config.exposure.max_time_us),
      toml_number(config.exposure.max_gain_db), toml_number(config.exposure.target_level),
      toml_number(config.exposure.max_step), zenoh_to_toml(config.zenoh), toml_number(config.health_period_s),
      toml_text(config.housing_temperature), toml_text(config.sensor_temperature), to_toml(config.rest));
}

}  // namespace imprint
