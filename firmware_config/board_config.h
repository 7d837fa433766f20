#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

/// What a board is built like, and so how it starts.
enum class BoardKind {
  uefi_amd64,       ///< UEFI and GRUB
  uefi_arm64,       ///< likewise
  raspberry_arm64,  ///< the firmware of Raspberry Pi class boards: config.txt, cmdline.txt
};
inline constexpr auto kBoardKinds = std::to_array<std::string_view>({"uefi-amd64", "uefi-arm64", "raspberry-arm64"});

enum class TimeSource {
  ntp,  ///< chrony from servers
  ptp,  ///< ptp4l to the network card's clock, chrony from there
};
inline constexpr auto kTimeSources = std::to_array<std::string_view>({"ntp", "ptp"});

/// One port of a board.
struct BoardPort {
  std::string match;    ///< name as the kernel gives it, `*` allowed, or a MAC address
  std::string address;  ///< "10.0.0.12/24", or "dhcp"
  std::string gateway;  ///< empty: none
  std::vector<std::string> dns;
  int mtu_bytes = 1500;
};

/// `board.toml`: everything that makes a generic board this camera. Holds no secret: who the board is to others is its
/// certificate, a folder beside the file.
struct BoardConfig {
  BoardKind kind = BoardKind::uefi_amd64;
  std::string site = "plant";
  std::string line = "L1";
  std::string camera_id;
  BoardPort network{.match = "en*", .address = "dhcp", .gateway = {}, .dns = {}};
  std::vector<BoardPort> camera_network;  ///< a port of its own for a GigE camera; at most one
  TimeSource time_source = TimeSource::ntp;
  std::vector<std::string> time_servers;
  std::vector<std::string> fusion;             ///< endpoints, "tls/10.0.0.5:7447"
  std::filesystem::path rig = "rig/rig.toml";  ///< beside board.toml
  std::string camera_source;                   ///< capture.source of node.toml
  std::string camera_usb_id;                   ///< "vendor:product" of a USB camera; it appears as /dev/imprint-camera
  std::string camera_keys;                     ///< further keys of [camera] and [capture] for node.toml, as TOML
  std::string sensor_overlay;                  ///< raspberry-arm64: of the CSI sensor, "imx477"
  int memory_max_mb = 400;                     ///< of the node; it takes 198 MB with frames of 16 megapixels
};

/// Reads and checks the file. Fails (invalid_input) with one line: file, line, key, what was expected, what was found.
Result<BoardConfig> read_board_config(const std::filesystem::path& path);

}  // namespace imprint
