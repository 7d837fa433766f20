#include "lib/daemon/program.h"

#include <algorithm>
#include <iostream>
#include <regex>
#include <sstream>

#include <CLI/CLI.hpp>

#include "lib/wire/keys.h"

namespace imprint {

std::optional<int> parse_program_options(int argc, char** argv, const std::string& name, const std::string& purpose,
                                         ProgramOptions& options) {
  CLI::App app{purpose, name};
  app.set_version_flag("--version", IMPRINT_VERSION);
  app.add_option("--config", options.config, "the config file (TOML; docs/configuration.md)")->required();
  app.add_flag("--check", options.check, "check the config and all it names, then stop");
  app.add_flag("--print-config", options.print_config, "print the config with its defaults, then stop");
  // One value each: `--set a.b=1 c.d=2` would otherwise swallow a forgotten --set.
  app.add_option("--set", options.overrides, "override one key: section.key=value")->expected(1)->take_all();
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::cerr << fmt::format("{}: {}; see {} --help\n", name, error.what(), name);
    return 2;
  }
  return std::nullopt;
}

int exit_status_of(const std::string& name, const std::function<Result<void>()>& run) {
  try {
    if (const auto done = run(); !done) {
      std::cerr << name << ": " << done.error().message << '\n';
      return done.error().exit_status();
    }
    return 0;
  } catch (const std::exception& error) {  // a fault of ours or of a library: still one line
    std::cerr << name << ": unexpected: " << error.what() << '\n';
    return 1;
  }
}

Result<toml::table> read_program_config(const ProgramOptions& options) {
  auto table = parse_toml_file(options.config);
  if (!table) return table;
  for (const std::string& assignment : options.overrides) {
    if (auto done = apply_override(*table, assignment); !done) return pass_on(done.error());
  }
  return table;
}

std::string read_id(TomlReader& read, std::string_view key, std::optional<std::string> fallback) {
  std::string id = read.string(key, std::move(fallback));
  if (read.error()) return id;
  if (const auto valid = check_id("", id); !valid) read.fault(key, valid.error().message);
  return id;
}

ZenohConfig read_zenoh_section(TomlReader& read, const ZenohConfig& defaults) {
  static const std::regex endpoint("(tcp|udp|tls)/[^\\s/]+:[0-9]{1,5}(\\?.*)?(#.*)?");
  ZenohConfig config = defaults;
  config.connect = read.strings("zenoh.connect", defaults.connect);
  config.listen = read.strings("zenoh.listen", defaults.listen);
  for (const auto& [key, endpoints] : {std::pair{"zenoh.connect", &config.connect}, {"zenoh.listen", &config.listen}}) {
    for (const std::string& text : *endpoints) {
      if (!std::regex_match(text, endpoint)) {
        read.fault(key, fmt::format("expected endpoints like \"tcp/127.0.0.1:7447\", found \"{}\"", text));
      }
    }
  }
  config.identity = read.path("zenoh.identity", defaults.identity);
  config.insecure = read.boolean("zenoh.insecure", defaults.insecure);
  if (const auto checked = check_zenoh(config); !checked && !read.error()) read.fault("zenoh", checked.error().message);
  return config;
}

std::string zenoh_to_toml(const ZenohConfig& config) {
  return fmt::format("connect = {}\nlisten = {}\n{}insecure = {}\n", toml_list(config.connect),
                     toml_list(config.listen),
                     config.identity.empty() ? "" : fmt::format("identity = {}\n", toml_text(config.identity.string())),
                     config.insecure);
}

std::string read_choice(TomlReader& read, std::string_view key, std::span<const std::string_view> choices,
                        std::optional<std::string> fallback) {
  std::string value = read.string(key, std::move(fallback));
  if (!read.error() && std::ranges::find(choices, value) == choices.end()) {
    std::string expected;
    for (const std::string_view choice : choices) expected.append(expected.empty() ? "" : ", ").append(choice);
    read.fault(key, fmt::format("expected one of {}; found \"{}\"", expected, value));
  }
  return value;
}

std::string toml_text(std::string_view text) {
  std::ostringstream out;
  out << toml::value<std::string>(std::string(text));
  return out.str();
}

std::string toml_number(double number) {
  const std::string text = fmt::format("{}", number);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::string toml_list(const std::vector<std::string>& texts) {
  std::string list = "[";
  for (const std::string& text : texts) list += (list.size() > 1 ? ", " : "") + toml_text(text);
  return list + "]";
}

}  // namespace imprint
