#include "fusion/serve/metrics.h"

#include <array>
#include <map>
#include <vector>

#include <fmt/format.h>

namespace imprint {
namespace {

using nlohmann::json;

struct Gauge {
  const char* name;
  const char* help;
  const char* pointer;  // into a camera of the status
};

constexpr auto kGauges = std::to_array<Gauge>({
    {"camera_connected", "1: the node is connected", "/alive"},
    {"camera_targets_seen", "targets in the last frame", "/health/targets_seen"},
    {"camera_reprojection_rms_px", "of the targets in the last frame", "/health/reprojection_rms_px"},
    {"camera_contrast", "median step across the rims, share of full scale", "/health/contrast"},
    {"camera_saturated_fraction", "share of saturated pixels inside the forging", "/health/saturated_fraction"},
    {"camera_blur_px", "standard deviation of the blur across the rims", "/health/blur_px"},
    {"camera_haze_px", "edge jitter beyond the noise", "/health/haze_px"},
    {"camera_body_level", "level of the forging, share of full scale", "/health/body_level"},
    {"camera_exposure_us", "exposure time of the last frame", "/health/exposure_us"},
    {"camera_frames", "frames taken since the node's start", "/health/frames"},
    {"camera_failed_frames", "of which no imprint could be made", "/health/failed_frames"},
    {"camera_dropped_frames", "taken by the camera, never whole at the node", "/health/dropped_frames"},
    {"camera_restarts", "times the camera was lost and opened anew", "/health/capture_restarts"},
    {"camera_housing_temperature_celsius", "of the board", "/health/housing_temperature_c"},
    {"camera_sensor_temperature_celsius", "of the image sensor", "/health/sensor_temperature_c"},
    {"camera_storage_free_megabytes", "on the node's data partition", "/health/storage_free_mb"},
    {"camera_health_age_seconds", "since the last health record", "/health/age_s"},
    {"camera_clock_offset_seconds", "node's clock minus fusion's", "/clock/offset_s"},
    {"camera_waiting_imprints", "in the node, without a receipt", "/delivery/node/waiting"},
    {"camera_discarded_imprints", "since the node's start, for want of room", "/delivery/node/discarded"},
    {"camera_missing_imprints", "between those that fusion has", "/delivery/missing"},
});

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\n')
      out += "\\n";
    else if (c == '"' || c == '\\')
      (out += '\\') += c;
    else
      out += c;
  }
  return out;
}

// One family: its two comments, then its samples.
class Family {
 public:
  Family(std::string& out, const char* name, const char* kind, const char* help) : out_(out), name_(name) {
    out_ += fmt::format("# HELP imprint_{} {}\n# TYPE imprint_{} {}\n", name_, help, name_, kind);
  }
  void sample(const std::string& labels, const json& value) {
    if (value.is_boolean()) return sample(labels, json(value.get<bool>() ? 1 : 0));
    if (value.is_number()) out_ += fmt::format("imprint_{}{{{}}} {}\n", name_, labels, value.dump());
  }

 private:
  std::string& out_;
  const char* name_;
};

}  // namespace

std::string prometheus_text(const json& status) {
  const std::string line = fmt::format("site=\"{}\",line=\"{}\"", escaped(status.at("site").get<std::string>()),
                                       escaped(status.at("line").get<std::string>()));
  std::string out;
  Family(out, "uptime_seconds", "gauge", "of fusion").sample(line, status.at("uptime_s"));
  Family events(out, "events_total", "counter", "of each kind, as in the status");
  for (const auto& [name, count] : status.at("counters").items())
    events.sample(line + ",event=\"" + name + "\"", count);
  Family alarms(out, "alarm", "gauge", "1: stands; acknowledged says whether somebody has seen it");
  for (const json& alarm : status.at("alarms")) {
    alarms.sample(fmt::format("{},alarm=\"{}\",acknowledged=\"{}\"", line, escaped(alarm.at("name").get<std::string>()),
                              alarm.at("acknowledged_by").is_null() ? "no" : "yes"),
                  1);
  }
  if (const json& history = status.at("history"); history.is_object()) {
    Family(out, "history_connected", "gauge", "1: PostgreSQL is reached").sample(line, history.at("connected"));
    Family(out, "history_waiting_messages", "gauge", "not yet in PostgreSQL")
        .sample(line, history.at("waiting_messages"));
    Family(out, "history_waiting_results", "gauge", "not yet in PostgreSQL, at most")
        .sample(line, history.at("waiting_results"));
  }
  for (const Gauge& gauge : kGauges) {
    Family family(out, gauge.name, "gauge", gauge.help);
    const json::json_pointer pointer(gauge.pointer);
    for (const json& camera : status.at("cameras")) {
      if (!camera.contains(pointer)) continue;
      family.sample(line + ",camera=\"" + escaped(camera.at("id").get<std::string>()) + '"', camera.at(pointer));
    }
  }
  Family versions(out, "camera_version_info", "gauge", "of the node's software");
  for (const json& camera : status.at("cameras")) {
    if (!camera.at("health").is_object()) continue;
    versions.sample(fmt::format("{},camera=\"{}\",version=\"{}\"", line, escaped(camera.at("id").get<std::string>()),
                                escaped(camera.at("health").at("version").get<std::string>())),
                    1);
  }
  return out;
}

}  // namespace imprint
