#include "firmware_config/board_config.h"

#include <catch2/catch.hpp>

#include "firmware_config/board_files.h"
#include "node/node_config.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

const std::string kBoard = R"(
[board]
kind = "uefi-amd64"
camera_id = "cam2"
[network]
address = "10.0.0.12/24"
gateway = "10.0.0.1"
dns = ["10.0.0.1"]
[time]
servers = ["10.0.0.5"]
[fusion]
connect = ["tls/10.0.0.5:7447"]
[camera]
source = "v4l2"
usb_id = "2a0b:00db"
format = "mono12"
exposure_us = 2000.0
)";

std::string with(const std::string& line, const std::string& other) {
  std::string text = kBoard;
  const auto at = text.find(line);
  REQUIRE(at != std::string::npos);
  return text.replace(at, line.size(), other);
}

Result<BoardConfig> read(const std::string& text) {
  const TemporaryFolder folder;
  return read_board_config(folder.write("board.toml", text));
}

std::string fault(const std::string& text) {
  const auto config = read(text);
  REQUIRE_FALSE(config);
  CHECK(config.error().exit_status() == 2);
  CHECK(config.error().message.find('\n') == std::string::npos);
  const auto& message = config.error().message;
  return message.substr(message.find("board.toml:"));
}

std::map<std::filesystem::path, std::string> files_of(const std::string& text) {
  const auto config = read(text);
  INFO((config ? "" : config.error().message));
  REQUIRE(config);
  return board_files(*config);
}

// The config of the node that these files start.
Result<NodeConfig> node_of(const std::string& text) {
  const TemporaryFolder folder;
  // The node looks whether its certificate is there: another folder's, for a board's is not here.
  for (const char* name : {"ca.pem", "cert.pem", "key.pem"}) folder.write(name, "as if");
  std::string node = files_of(text).at("run/imprint/node.toml");
  const std::string identity = std::string(kBoardFolder) + "/identity";
  REQUIRE(node.find(identity) != std::string::npos);
  node.replace(node.find(identity), identity.size(), folder.path().string());
  const auto path = folder.write("node.toml", node);
  const auto table = parse_toml_file(path);
  if (!table) return pass_on(table.error());
  return read_node_config(path, *table);
}

}  // namespace

TEST_CASE("board: the node it makes is this camera of this line, with its camera's keys") {
  const auto node = node_of(kBoard);
  INFO((node ? "" : node.error().message));
  REQUIRE(node);
  CHECK(node->camera_id == "cam2");
  CHECK(node->line == "L1");
  CHECK(node->rig == "/data/board/rig/rig.toml");
  CHECK(node->zenoh.connect == std::vector<std::string>{"tls/10.0.0.5:7447"});
  CHECK(node->camera.device == "/dev/imprint-camera");
  CHECK(node->camera.format == PixelFormat::mono12);
  CHECK(node->camera.exposure.time_us == 2000.0);
}

TEST_CASE("board: network, names, clocks and limits are what the file says") {
  const auto files = files_of(kBoard);
  CHECK_THAT(files.at("run/systemd/network/10-imprint.network"),
             Catch::Contains("Name=en*\n") && Catch::Contains("Address=10.0.0.12/24\n") &&
                 Catch::Contains("Gateway=10.0.0.1\n") && !Catch::Contains("DHCP"));
  CHECK(files.at("run/imprint/hostname") == "imprint-L1-cam2\n");
  CHECK_THAT(files.at("run/imprint/chrony.conf"), Catch::Contains("server 10.0.0.5 iburst"));
  CHECK_THAT(files.at("run/udev/rules.d/70-imprint.rules"),
             Catch::Contains("ATTRS{idVendor}==\"2a0b\", ATTRS{idProduct}==\"00db\", SYMLINK+=\"imprint-camera\""));
  CHECK_THAT(files.at("run/systemd/system/imprint-node.service.d/10-board.conf"),
             Catch::Contains("MemoryMax=400M") && Catch::Contains("DeviceAllow=char-video4linux rw"));
  CHECK(files.contains("boot/efi/grub/board.cfg"));
  CHECK_FALSE(files.contains("boot/firmware/config.txt"));
  CHECK_FALSE(files.contains("run/imprint/ptp4l.conf"));
}

TEST_CASE("board: a GigE camera gets its port, its buffers and PTP where they are asked for") {
  std::string text = with("source = \"v4l2\"\nusb_id = \"2a0b:00db\"\n", "source = \"aravis\"\npacket_bytes = 8000\n");
  text += "[camera_network]\nmatch = \"00:11:22:33:44:55\"\naddress = \"169.254.1.1/16\"\n";
  text.replace(text.find("servers = [\"10.0.0.5\"]"), 22, "source = \"ptp\"");
  const auto files = files_of(text);
  CHECK_THAT(files.at("run/systemd/network/11-imprint-camera.network"),
             Catch::Contains("MACAddress=00:11:22:33:44:55\n") && Catch::Contains("MTUBytes=9000\n"));
  CHECK_THAT(files.at("run/sysctl.d/60-imprint.conf"), Catch::Contains("net.core.rmem_max = 134217728"));
  CHECK_THAT(files.at("run/imprint/ptp4l.conf"), Catch::Contains("slaveOnly 1"));
  CHECK_THAT(files.at("run/imprint/chrony.conf"), Catch::Contains("refclock PHC /dev/ptp0"));
}

TEST_CASE("board: a Raspberry Pi class board gets its firmware's files instead of GRUB's") {
  std::string text = with("uefi-amd64", "raspberry-arm64");
  text.replace(text.find("usb_id = \"2a0b:00db\""), 20, "sensor_overlay = \"imx477\"");
  const auto files = files_of(text);
  CHECK_THAT(files.at("boot/firmware/config.txt"), Catch::Contains("dtoverlay=imx477\n"));
  CHECK_THAT(files.at("boot/firmware/cmdline.txt"), Catch::Contains("imprint.root=rootfsA rauc.slot=A"));
  CHECK_FALSE(files.contains("boot/efi/grub/board.cfg"));
}

TEST_CASE("board: with UEFI an arm64 board gets the files of an amd64 one") {
  CHECK(files_of(with("uefi-amd64", "uefi-arm64")) == files_of(with("uefi-amd64", "uefi-amd64")));
}

TEST_CASE("board: what is wrong is one line with its key, and what was expected") {
  CHECK(fault(with("\"uefi-amd64\"", "\"toaster\"")).find("board.kind: expected") != std::string::npos);
  CHECK(fault(with("10.0.0.12/24", "10.0.0.300/24")) ==
        "board.toml:6: network.address: expected \"dhcp\" or an address as \"10.0.0.12/24\", found \"10.0.0.300/24\"");
  CHECK(fault(with("gateway = \"10.0.0.1\"", "gateway = \"router\"")).find("network.gateway: ") != std::string::npos);
  CHECK(fault(with("tls/10.0.0.5:7447", "tcp/10.0.0.5:7447")).find("fusion.connect: expected endpoints as \"tls/") !=
        std::string::npos);
  CHECK(fault(with("servers = [\"10.0.0.5\"]", "servers = []")).find("time.servers: none") != std::string::npos);
  CHECK(fault(with("2a0b:00db", "camera")).find("camera.usb_id: expected vendor:product") != std::string::npos);
  CHECK(fault(with("camera_id = \"cam2\"", "camera_id = \"../cam\"")).find("board.camera_id: ") != std::string::npos);
  CHECK(fault(with("camera_id = \"cam2\"", "camera_id = \"cam2\"\nrig = \"/etc/rig.toml\"")).find("board.rig: ") !=
        std::string::npos);
  CHECK(fault(with("[time]", "[tide]")).find("tide: unknown") != std::string::npos);
  CHECK(fault(with("gateway", "gate")).find("network.gate: unknown") != std::string::npos);
  CHECK(fault(with("usb_id = \"2a0b:00db\"", "sensor_overlay = \"imx477\"")).find("camera.sensor_overlay: only") !=
        std::string::npos);
}

TEST_CASE("board: a secret is refused wherever it stands") {
  CHECK(fault(with("[time]", "wifi_psk = \"x\"\n[time]")).find("network.wifi_psk: a secret does not belong here") !=
        std::string::npos);
  CHECK(fault(kBoard + "password = \"x\"\n").find("camera.password: a secret does not belong here") !=
        std::string::npos);
}

TEST_CASE("board: files are written below the root that is named, or only a part of them") {
  const TemporaryFolder folder;
  const auto config = read(kBoard);
  REQUIRE(config);
  REQUIRE(write_board_files(*config, folder / "all", ""));
  for (const auto& [path, text] : board_files(*config))
    CHECK(std::filesystem::file_size(folder / "all" / path) == text.size());
  REQUIRE(write_board_files(*config, folder / "run-only", "run"));
  CHECK(std::filesystem::exists(folder / "run-only" / "run/imprint/node.toml"));
  CHECK_FALSE(std::filesystem::exists(folder / "run-only" / "boot"));
}

TEST_CASE("board: the template in the repository is right") { CHECK(read_board_config(IMPRINT_BOARD_TEMPLATE)); }

}  // namespace imprint
