#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lib/config/toml_file.h"
#include "lib/result/result.h"
#include "lib/transport/transport.h"

namespace imprint {

/// The command line that `imprint-node` and `imprint-fusion` share (contract section 4).
struct ProgramOptions {
  std::filesystem::path config;
  bool check = false;         ///< read and check everything, say OK, start nothing
  bool print_config = false;  ///< the effective config as TOML on stdout
  std::vector<std::string> overrides;
};

/// Reads the command line into `options`; an exit status when there is nothing left to do (--help, wrong use).
std::optional<int> parse_program_options(int argc, char** argv, const std::string& name, const std::string& purpose,
                                         ProgramOptions& options);

/// The config file with `--set` applied over it.
Result<toml::table> read_program_config(const ProgramOptions& options);

/// Sites, lines, cameras and sessions become chunks of keys and names of files: 1 to 64 letters, digits, '_', '-' or
/// '.', the last not first.
bool is_plain_name(std::string_view name);
std::string read_plain_name(TomlReader& read, std::string_view key, std::optional<std::string> fallback);

/// `zenoh.connect` and `zenoh.listen`; an endpoint reads "tcp/<address>:<port>" (tcp, udp or tls).
ZenohConfig read_zenoh_section(TomlReader& read, const ZenohConfig& defaults);

/// A TOML string or list for --print-config.
std::string toml_text(std::string_view text);
std::string toml_list(const std::vector<std::string>& texts);

}  // namespace imprint
