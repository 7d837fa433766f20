#include "firmware_config/board_files.h"

#include "lib/config/atomic_file.h"
#include "lib/daemon/program.h"

namespace imprint {
namespace {

constexpr const char* kMade = "# Made from board.toml; what is changed here is gone with the next start.\n";

bool has_camera_port(const BoardConfig& config) { return !config.camera_network.empty(); }

std::string host_name(const BoardConfig& config) {
  std::string name = fmt::format("imprint-{}-{}", config.line, config.camera_id);
  for (char& letter : name)
    if (letter == '_' || letter == '.') letter = '-';
  return name.substr(0, 63);
}

std::string network_file(const BoardPort& port) {
  const bool mac = port.match.find(':') != std::string::npos;
  std::string text = fmt::format("{}[Match]\n{}={}\n\n[Link]\nMTUBytes={}\n\n[Network]\nLLMNR=no\nIPv6AcceptRA=no\n",
                                 kMade, mac ? "MACAddress" : "Name", port.match, port.mtu_bytes);
  text += port.address == "dhcp" ? "DHCP=ipv4\n" : "Address=" + port.address + "\n";
  if (!port.gateway.empty()) text += "Gateway=" + port.gateway + "\n";
  return text;
}

std::string resolver_file(const BoardConfig& config) {
  std::string text = kMade;
  for (const std::string& server : config.network.dns) text += "nameserver " + server + "\n";
  return text;
}

// Buffers for a GigE camera's frames, as large as the node asks for; a restart rather than a board that hangs.
std::string sysctl_file(const BoardConfig& config) {
  std::string text = fmt::format(
      "{}kernel.panic = 5\nkernel.panic_on_oops = 1\nvm.swappiness = 0\n"
      "vm.dirty_writeback_centisecs = 6000\nvm.dirty_expire_centisecs = 6000\n",
      kMade);
  if (config.camera_source == "aravis")
    text += "net.core.rmem_max = 134217728\nnet.core.rmem_default = 1048576\nnet.core.netdev_max_backlog = 5000\n";
  return text;
}

std::string udev_file(const BoardConfig& config) {
  std::string text = kMade;
  if (config.camera_source == "libcamera")
    text +=
        "SUBSYSTEM==\"media\", GROUP=\"video\", MODE=\"0660\"\n"
        "SUBSYSTEM==\"dma_heap\", GROUP=\"video\", MODE=\"0660\"\n";
  if (!config.camera_usb_id.empty()) {
    const std::string vendor = config.camera_usb_id.substr(0, 4);
    const std::string product = config.camera_usb_id.substr(5);
    text += fmt::format(
        "SUBSYSTEM==\"video4linux\", ATTR{{index}}==\"0\", ATTRS{{idVendor}}==\"{0}\", ATTRS{{idProduct}}==\"{1}\", "
        "SYMLINK+=\"imprint-camera\", GROUP=\"video\", MODE=\"0660\"\n"
        "SUBSYSTEM==\"usb\", ATTR{{idVendor}}==\"{0}\", ATTR{{idProduct}}==\"{1}\", GROUP=\"video\", MODE=\"0660\", "
        "ATTR{{power/control}}=\"on\"\n",
        vendor, product);
  } else {
    text += "SUBSYSTEM==\"video4linux\", GROUP=\"video\", MODE=\"0660\"\n";
  }
  return text;
}

std::string chrony_file(const BoardConfig& config) {
  std::string text = kMade;
  for (const std::string& server : config.time_servers) text += "server " + server + " iburst minpoll 4 maxpoll 6\n";
  if (config.time_source == TimeSource::ptp) text += "refclock PHC /dev/ptp0 poll 0 dpoll -2 tai\n";
  // Stepped whenever it is off by more than a second in the first minutes, later slewed: times of frames stay in order.
  return text + "makestep 1.0 30\nrtcsync\ndriftfile /data/chrony/drift\ncmdport 0\nport 0\n";
}

std::string ptp_file(const BoardConfig& config) {
  return fmt::format("{}[global]\nslaveOnly 1\ntime_stamping hardware\nnetwork_transport UDPv4\n[{}]\n", kMade,
                     config.network.match);
}

std::string node_file(const BoardConfig& config) {
  const std::string folder = kBoardFolder;
  const bool needs_path =
      config.camera_source == "folder" || config.camera_source == "session" || config.camera_source == "simulation";
  std::string text = fmt::format(
      "{}[node]\nsite = {}\nline = {}\ncamera_id = {}\nrig = {}\ndata_dir = {}\n\n[zenoh]\nconnect = {}\nidentity = "
      "{}\n\n"
      "[capture]\nsource = {}\n",
      kMade, toml_text(config.site), toml_text(config.line), toml_text(config.camera_id),
      toml_text(folder + "/" + config.rig.string()), toml_text(kNodeDataFolder), toml_list(config.fusion),
      toml_text(folder + "/identity"), toml_text(config.camera_source));
  if (needs_path) return text + fmt::format("path = {}\n", toml_text(folder + "/" + config.rig.parent_path().string()));
  text += "\n[camera]\n";
  if (!config.camera_usb_id.empty() && config.camera_source == "v4l2") text += "device = \"/dev/imprint-camera\"\n";
  return text + config.camera_keys;
}

std::string unit_file(const BoardConfig& config) {
  std::string text = fmt::format("{}[Service]\nMemoryMax={}M\n", kMade, config.memory_max_mb);
  if (config.camera_source == "v4l2" || config.camera_source == "libcamera")
    text += "DeviceAllow=char-video4linux rw\nDeviceAllow=char-media rw\n";
  if (config.camera_source == "libcamera") text += "DeviceAllow=char-dma_heap rw\n";  // its buffers
  if (config.camera_source == "aravis") text += "DeviceAllow=char-usb_device rw\n";
  return text;
}

std::string firmware_file(const BoardConfig& config) {
  std::string text =
      "# Made from board.toml.\narm_64bit=1\nkernel=vmlinuz\ninitramfs initrd followkernel\nenable_uart=1\n"
      "camera_auto_detect=0\ndtparam=watchdog=on\ndtoverlay=disable-bt\ngpu_mem=64\n";
  if (!config.sensor_overlay.empty()) text += "dtoverlay=" + config.sensor_overlay + "\n";
  return text;
}

}  // namespace

std::map<std::filesystem::path, std::string> board_files(const BoardConfig& config) {
  std::map<std::filesystem::path, std::string> files{
      {"run/imprint/node.toml", node_file(config)},
      {"run/imprint/chrony.conf", chrony_file(config)},
      {"run/imprint/hostname", host_name(config) + "\n"},
      {"run/imprint/resolv.conf", resolver_file(config)},
      {"run/sysctl.d/60-imprint.conf", sysctl_file(config)},
      {"run/udev/rules.d/70-imprint.rules", udev_file(config)},
      {"run/systemd/network/10-imprint.network", network_file(config.network)},
      {"run/systemd/system/imprint-node.service.d/10-board.conf", unit_file(config)},
  };
  if (has_camera_port(config))
    files["run/systemd/network/11-imprint-camera.network"] = network_file(config.camera_network.front());
  if (config.time_source == TimeSource::ptp) files["run/imprint/ptp4l.conf"] = ptp_file(config);
  if (config.kind == BoardKind::raspberry_arm64) {
    files["boot/firmware/config.txt"] = firmware_file(config);
    files["boot/firmware/cmdline.txt"] =
        "imprint.root=rootfsA rauc.slot=A console=tty1 console=serial0,115200 quiet panic=5\n";
  } else {
    files["boot/efi/grub/board.cfg"] = std::string("# Made from board.toml.\nset board_options=\"") +
                                       (config.camera_source == "aravis" ? "processor.max_cstate=1" : "") + "\"\n";
  }
  return files;
}

Result<void> write_board_files(const BoardConfig& config, const std::filesystem::path& root, const std::string& part) {
  for (const auto& [path, text] : board_files(config)) {
    if (!part.empty() && path.begin()->string() != part) continue;
    std::error_code failed;
    std::filesystem::create_directories((root / path).parent_path(), failed);
    if (failed) return job_failed("{}: {}", (root / path).parent_path().string(), failed.message());
    if (auto written = write_file_atomically(root / path, text); !written) return written;
  }
  return {};
}

}  // namespace imprint
