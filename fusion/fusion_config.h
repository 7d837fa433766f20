#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fusion/geometry_method.h"
#include "fusion/plc_input.h"
#include "fusion/receive/observation_assembler.h"
#include "fusion/rest_trigger.h"
#include "fusion/serve/page_server.h"
#include "lib/config/toml_file.h"
#include "lib/result/result.h"
#include "lib/transport/transport.h"

namespace imprint {

/// `fusion.toml`; every key with unit and default in docs/configuration.md.
struct FusionConfig {
  std::string site = "plant";
  std::string line = "L1";
  std::filesystem::path rig;
  std::filesystem::path database = "imprint.db";
  std::filesystem::path result_dir;          // empty: none
  std::string postgresql;                    // connection string of a copy of the histories; empty: none
  std::vector<std::filesystem::path> lines;  // fusion.toml of further lines that the same program fuses
  std::string method = "best";
  GeometryMethod geometry = GeometryMethod::joint;
  std::string log_level = "info";
  AssemblerConfig assembler;
  ZenohConfig zenoh{.connect = {}, .listen = {"tcp/127.0.0.1:7447"}, .router = true};
  std::filesystem::path access;  // who may do what at this router: access.json of `imprint certs`; empty: everybody all
  PageConfig page;
  HealthLimits alarms;
  PlcConfig plc;
  RestTriggerConfig rest;
};

/// Reads the table of `fusion.toml`; `path` is what relative paths and messages refer to.
Result<FusionConfig> read_fusion_config(const std::filesystem::path& path, const toml::table& table);

/// The effective config in the file's own form.
std::string to_toml(const FusionConfig& config);

}  // namespace imprint
