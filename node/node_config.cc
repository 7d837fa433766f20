#include "node/node_config.h"

#include "lib/daemon/program.h"
#include "node/capture/frame_source.h"

namespace imprint {

Result<NodeConfig> read_node_config(const std::filesystem::path& path, const toml::table& table) {
  NodeConfig config;
  TomlReader read(path, table);
  read.only({"node.site", "node.line", "node.camera_id", "node.rig", "node.method", "node.log_level", "capture.source",
             "capture.path", "zenoh.connect", "zenoh.listen", "health.period_s"});
  config.site = read_id(read, "node.site", config.site);
  config.line = read_id(read, "node.line", config.line);
  config.camera_id = read_id(read, "node.camera_id", std::nullopt);
  config.rig = read.path("node.rig");
  config.method = read_choice(read, "node.method", kMethods, config.method);
  config.log_level = read_choice(read, "node.log_level", kLogLevels, config.log_level);
  config.capture_source = read_choice(read, "capture.source", kFrameSources, std::nullopt);
  config.capture_path = read.path("capture.path");
  config.zenoh = read_zenoh_section(read, config.zenoh);
  config.health_period_s = read.number("health.period_s", config.health_period_s);
  if (!(config.health_period_s >= 0.1 && config.health_period_s <= 3600.0)) {
    read.fault("health.period_s", fmt::format("expected 0.1 to 3600 s, found {}", config.health_period_s));
  }
  if (config.zenoh.connect.empty() && config.zenoh.listen.empty()) {
    read.fault("zenoh.connect", "no endpoint here nor in zenoh.listen: fusion could not be reached");
  }
  if (const auto error = read.error()) return pass_on(*error);
  return config;
}

std::string to_toml(const NodeConfig& config) {
  return fmt::format(
      "[node]\nsite = {}\nline = {}\ncamera_id = {}\nrig = {}\nmethod = {}\nlog_level = {}\n\n"
      "[capture]\nsource = {}\npath = {}\n\n[zenoh]\nconnect = {}\nlisten = {}\n\n[health]\nperiod_s = {}\n",
      toml_text(config.site), toml_text(config.line), toml_text(config.camera_id), toml_text(config.rig.string()),
      toml_text(config.method), toml_text(config.log_level), toml_text(config.capture_source),
      toml_text(config.capture_path.string()), toml_list(config.zenoh.connect), toml_list(config.zenoh.listen),
      toml_number(config.health_period_s));
}

}  // namespace imprint
