#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
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

/// Runs the program and gives its exit status; a failure is one line on stderr.
int exit_status_of(const std::string& name, const std::function<Result<void>()>& run);

/// The config file with `--set` applied over it.
Result<toml::table> read_program_config(const ProgramOptions& options);

/// An id (site, line, camera) that becomes a chunk of a key: `check_id` of lib/wire/keys.h.
std::string read_id(TomlReader& read, std::string_view key, std::optional<std::string> fallback);

/// `zenoh.connect` and `zenoh.listen`, an endpoint reads "tls/<address>:<port>" (tcp, udp or tls); `zenoh.identity`,
/// `zenoh.insecure`.
ZenohConfig read_zenoh_section(TomlReader& read, const ZenohConfig& defaults);
/// The same keys in the file's own form.
std::string zenoh_to_toml(const ZenohConfig& config);

/// One of a few words.
std::string read_choice(TomlReader& read, std::string_view key, std::span<const std::string_view> choices,
                        std::optional<std::string> fallback);
/// The edge methods of contract section 3, and the levels of lib/log.
inline constexpr auto kMethods =
    std::to_array<std::string_view>({"best", "orientation", "magnitude", "combined", "uniform", "none", "pixel"});
inline constexpr auto kLogLevels =
    std::to_array<std::string_view>({"trace", "debug", "info", "warning", "error", "off"});

/// A TOML string, number or list for --print-config.
std::string toml_text(std::string_view text);
std::string toml_number(double number);
std::string toml_list(const std::vector<std::string>& texts);

}  // namespace imprint
