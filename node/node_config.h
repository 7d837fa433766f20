#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "lib/config/toml_file.h"
#include "lib/result/result.h"
#include "lib/transport/transport.h"
#include "node/capture/camera_settings.h"
#include "node/capture/exposure_control.h"
#include "node/service/rest_watch.h"

namespace imprint {

/// `node.toml`; every key with unit and default in docs/configuration.md.
struct NodeConfig {
  std::string site = "plant";
  std::string line = "L1";
  std::string camera_id;
  std::filesystem::path rig;
  std::string method = "best";
  std::string log_level = "info";
  std::string capture_source;          // folder, session, simulation, imprints, or a camera: v4l2, aravis
  std::filesystem::path capture_path;  // the folder, the session.toml or the scene; of a camera nothing
  CameraSettings camera;               // of a camera
  ExposureConfig exposure;
  ZenohConfig zenoh{.connect = {"tcp/127.0.0.1:7447"}, .listen = {}, .router = false};
  double health_period_s = 5.0;
  std::string housing_temperature;  // where it is read: hwmon:CHIP/tempN, file:PATH, simulated; empty: not
  std::string sensor_temperature;   // of the image sensor, likewise
  std::filesystem::path data_dir;   // imprints wait below it for fusion's receipt; empty: in memory alone
  std::int64_t spool_max_mb = 256;  // of imprints that wait, then the oldest end; ours: 65,000 imprints
  double retry_s = 5.0;             // an imprint without a receipt for so long is sent again
  RestConfig rest;
};

/// Reads the table of `node.toml`; `path` is what relative paths and messages refer to.
Result<NodeConfig> read_node_config(const std::filesystem::path& path, const toml::table& table);

/// Whether its frames come from a camera, set by `NodeConfig::camera`.
bool has_camera(const NodeConfig& config);

/// The effective config in the file's own form.
std::string to_toml(const NodeConfig& config);

}  // namespace imprint
