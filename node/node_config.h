#pragma once

#include <filesystem>
#include <string>

#include "lib/config/toml_file.h"
#include "lib/result/result.h"
#include "lib/transport/transport.h"

namespace imprint {

/// `node.toml`; every key with unit and default in docs/configuration.md.
struct NodeConfig {
  std::string site = "plant";
  std::string line = "L1";
  std::string camera_id;
  std::filesystem::path rig;
  std::string method = "best";
  std::string log_level = "info";
  std::string capture_source;          // folder, session or simulation
  std::filesystem::path capture_path;  // the folder, the session.toml or the scene
  ZenohConfig zenoh{.connect = {"tcp/127.0.0.1:7447"}, .listen = {}, .router = false};
  double health_period_s = 5.0;
};

/// Reads the table of `node.toml`; `path` is what relative paths and messages refer to.
Result<NodeConfig> read_node_config(const std::filesystem::path& path, const toml::table& table);

/// The effective config in the file's own form.
std::string to_toml(const NodeConfig& config);

}  // namespace imprint
