#include "firmware_config/board_config.h"

#include <algorithm>
#include <regex>
#include <sstream>

#include "lib/config/toml_file.h"
#include "lib/daemon/program.h"

namespace imprint {
namespace {

constexpr auto kCameraSources =
    std::to_array<std::string_view>({"v4l2", "aravis", "libcamera", "folder", "session", "simulation"});
// Words that name what must not be in a file that is copied, mailed and kept under version control.
constexpr auto kSecretWords =
    std::to_array<std::string_view>({"password", "passphrase", "secret", "psk", "token", "private"});

bool is_address(const std::string& text) {
  static const std::regex dotted(R"((\d{1,3})\.(\d{1,3})\.(\d{1,3})\.(\d{1,3}))");
  std::smatch parts;
  if (!std::regex_match(text, parts, dotted)) return false;
  return std::all_of(parts.begin() + 1, parts.end(), [](const auto& part) { return std::stoi(part.str()) <= 255; });
}

bool is_host(const std::string& text) {
  static const std::regex name(R"([A-Za-z0-9]([A-Za-z0-9-]*[A-Za-z0-9])?(\.[A-Za-z0-9]([A-Za-z0-9-]*[A-Za-z0-9])?)*)");
  return is_address(text) || (text.size() <= 253 && std::regex_match(text, name));
}

bool is_network_address(const std::string& text) {
  const auto slash = text.find('/');
  if (slash == std::string::npos || !is_address(text.substr(0, slash))) return false;
  const std::string bits = text.substr(slash + 1);
  return std::regex_match(bits, std::regex(R"(\d{1,2})")) && std::stoi(bits) >= 1 && std::stoi(bits) <= 32;
}

bool matches(const std::string& text, const char* pattern) { return std::regex_match(text, std::regex(pattern)); }

template <class Enum, std::size_t size>
Enum read_word(TomlReader& read, std::string_view key, const std::array<std::string_view, size>& words,
               std::optional<std::string> fallback) {
  const auto found = std::ranges::find(words, read_choice(read, key, words, std::move(fallback)));
  return static_cast<Enum>(found == words.end() ? 0 : found - words.begin());
}

void refuse_secrets(TomlReader& read, const toml::table& table, const std::string& prefix) {
  for (const auto& [name, value] : table) {
    const std::string key = prefix + std::string(name.str());
    if (std::ranges::any_of(kSecretWords, [&](auto word) { return name.str().find(word) != std::string_view::npos; }))
      read.fault(key, "a secret does not belong here; certificates go to identity/ beside this file");
    if (const toml::table* inner = value.as_table()) refuse_secrets(read, *inner, key + ".");
  }
}

BoardPort read_port(TomlReader& read, const std::string& section, const BoardPort& defaults) {
  BoardPort port = defaults;
  const auto key = [&](const char* name) { return section + "." + name; };
  port.match = read.string(key("match"), port.match);
  if (!matches(port.match, R"([A-Za-z0-9*_.-]{1,15}|([0-9A-Fa-f]{2}:){5}[0-9A-Fa-f]{2})"))
    read.fault(key("match"),
               fmt::format("expected a port's name, as \"en*\", or a MAC address, found \"{}\"", port.match));
  port.address = read.string(key("address"), port.address);
  if (port.address != "dhcp" && !is_network_address(port.address))
    read.fault(key("address"),
               fmt::format("expected \"dhcp\" or an address as \"10.0.0.12/24\", found \"{}\"", port.address));
  port.gateway = read.string(key("gateway"), port.gateway);
  if (!port.gateway.empty() && !is_address(port.gateway))
    read.fault(key("gateway"), fmt::format("expected an address as \"10.0.0.1\", found \"{}\"", port.gateway));
  port.dns = read.strings(key("dns"), port.dns);
  for (const std::string& server : port.dns)
    if (!is_address(server)) read.fault(key("dns"), fmt::format("expected addresses, found \"{}\"", server));
  const std::int64_t mtu = read.integer(key("mtu_bytes"), port.mtu_bytes);
  if (mtu < 576 || mtu > 16'000) read.fault(key("mtu_bytes"), fmt::format("expected 576 to 16000, found {}", mtu));
  port.mtu_bytes = static_cast<int>(std::clamp<std::int64_t>(mtu, 576, 16'000));
  return port;
}

void read_time(TomlReader& read, BoardConfig& config) {
  config.time_source = read_word<TimeSource>(read, "time.source", kTimeSources, "ntp");
  config.time_servers = read.strings("time.servers", std::vector<std::string>{});
  for (const std::string& server : config.time_servers)
    if (!is_host(server)) read.fault("time.servers", fmt::format("expected hosts, found \"{}\"", server));
  if (config.time_source == TimeSource::ntp && config.time_servers.empty())
    read.fault("time.servers", "none: the board's clock would drift, and certificates and triggers need it");
}

void read_fusion(TomlReader& read, BoardConfig& config) {
  config.fusion = read.strings("fusion.connect");
  if (config.fusion.empty()) read.fault("fusion.connect", "expected at least one endpoint as \"tls/10.0.0.5:7447\"");
  for (const std::string& endpoint : config.fusion)
    if (!matches(endpoint, R"(tls/[A-Za-z0-9.-]+:\d{1,5})"))
      read.fault("fusion.connect", fmt::format("expected endpoints as \"tls/10.0.0.5:7447\", found \"{}\"", endpoint));
}

// What node.toml has under [camera] besides, passed on as it stands: the node checks it.
std::string other_camera_keys(const toml::table& table) {
  toml::table kept;
  if (const toml::table* camera = table["camera"].as_table()) {
    for (const auto& [name, value] : *camera)
      if (name != "source" && name != "path" && name != "usb_id" && name != "sensor_overlay") kept.insert(name, value);
  }
  if (kept.empty()) return "";
  std::ostringstream text;
  text << kept;
  return text.str() + "\n";
}

void read_camera(TomlReader& read, const toml::table& table, BoardConfig& config) {
  config.camera_source = read_choice(read, "camera.source", kCameraSources, std::nullopt);
  config.camera_usb_id = read.string("camera.usb_id", "");
  if (!config.camera_usb_id.empty() && !matches(config.camera_usb_id, "[0-9a-f]{4}:[0-9a-f]{4}"))
    read.fault("camera.usb_id",
               fmt::format("expected vendor:product as lsusb shows it, found \"{}\"", config.camera_usb_id));
  config.sensor_overlay = read.string("camera.sensor_overlay", "");
  if (!config.sensor_overlay.empty() && config.kind != BoardKind::raspberry_arm64)
    read.fault("camera.sensor_overlay", "only boards of kind raspberry-arm64 have sensor overlays");
  if (!matches(config.sensor_overlay, "[a-z0-9,=-]*"))
    read.fault("camera.sensor_overlay", fmt::format("expected an overlay's name, found \"{}\"", config.sensor_overlay));
  config.camera_keys = other_camera_keys(table);
}

}  // namespace

Result<BoardConfig> read_board_config(const std::filesystem::path& path) {
  const auto table = parse_toml_file(path);
  if (!table) return pass_on(table.error());
  BoardConfig config;
  TomlReader read(path, *table);
  refuse_secrets(read, *table, "");
  for (const auto& [section, value] : *table) {
    constexpr auto known =
        std::to_array<std::string_view>({"board", "network", "camera_network", "time", "fusion", "camera"});
    if (std::ranges::find(known, section.str()) == known.end())
      read.fault(section.str(), "unknown; expected board, network, camera_network, time, fusion or camera");
  }
  const auto check_keys = [&](std::string_view section, std::initializer_list<std::string_view> keys) {
    const toml::table* inner = (*table)[section].as_table();
    if (inner == nullptr) return;
    for (const auto& [name, value] : *inner)
      if (std::ranges::find(keys, name.str()) == keys.end())
        read.fault(fmt::format("{}.{}", section, name.str()),
                   fmt::format("unknown; expected one of {}", fmt::join(keys, ", ")));
  };
  check_keys("board", {"kind", "site", "line", "camera_id", "rig", "memory_max_mb"});
  check_keys("network", {"match", "address", "gateway", "dns", "mtu_bytes"});
  check_keys("camera_network", {"match", "address", "gateway", "dns", "mtu_bytes"});
  check_keys("time", {"source", "servers"});
  check_keys("fusion", {"connect"});

  config.kind = read_word<BoardKind>(read, "board.kind", kBoardKinds, std::nullopt);
  config.site = read_id(read, "board.site", config.site);
  config.line = read_id(read, "board.line", config.line);
  config.camera_id = read_id(read, "board.camera_id", std::nullopt);
  config.rig = read.string("board.rig", config.rig.string());
  if (config.rig.is_absolute() || config.rig.string().find("..") != std::string::npos)
    read.fault("board.rig", "expected a path below this file's folder");
  const std::int64_t memory = read.integer("board.memory_max_mb", config.memory_max_mb);
  if (memory < 100 || memory > 16'000)
    read.fault("board.memory_max_mb", fmt::format("expected 100 to 16000 MB, found {}", memory));
  config.memory_max_mb = static_cast<int>(std::clamp<std::int64_t>(memory, 100, 16'000));
  config.network = read_port(read, "network", config.network);
  if (table->contains("camera_network"))
    config.camera_network = {read_port(read, "camera_network", {"", "", {}, {}, 9000})};
  read_time(read, config);
  read_fusion(read, config);
  read_camera(read, *table, config);
  if (const auto error = read.error()) return pass_on(*error);
  return config;
}

}  // namespace imprint
