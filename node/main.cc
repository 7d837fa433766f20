#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <iostream>
#include <memory>
#include <mutex>

#include "lib/access/identity.h"
#include "lib/daemon/program.h"
#include "lib/daemon/stop_signal.h"
#include "lib/daemon/systemd_notice.h"
#include "lib/log/log.h"
#include "node/node_config.h"
#include "node/node_service.h"
#include "node/replay/imprint_replay.h"
#include "node/service/forging_look.h"
#include "node/service/node_desk.h"

namespace imprint {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr auto kPoll = std::chrono::milliseconds(250);  // for settings from afar
constexpr auto kTrialTime = std::chrono::seconds(30);   // in which a start on trial must find fusion
constexpr auto kHangLimit = std::chrono::seconds(60);   // a frame takes a second, a simulated one six

enum class Ended { stopped, restart };

// Whether settings from afar want the node to start anew; keeps those on trial once fusion is there, and rolls them
// back when it is not.
bool restart_wanted(NodeDesk& desk, RemoteSettings& settings, steady_clock::time_point begin) {
  if (desk.restart_wanted()) return true;
  if (!settings.on_trial()) return false;
  if (desk.fusion_seen()) {
    if (const auto kept = desk.accept_settings(); !kept) spdlog::error("{}", kept.error().message);
    return false;
  }
  if (steady_clock::now() - begin < kTrialTime) return false;
  settings.roll_back("fusion was not found with them");
  return true;
}

// Until told to stop or to start anew: health when it is due, the watchdog as long as the worker gets on.
Ended attend(NodeService& service, NodeDesk& desk, RemoteSettings& settings, StopSignal& stop, double health_period_s) {
  const auto begin = steady_clock::now();
  const auto health_period = milliseconds(std::llround(1000.0 * health_period_s));
  const auto watchdog = watchdog_period();
  auto health_due = steady_clock::now() + health_period;
  while (true) {
    auto wait = std::chrono::ceil<milliseconds>(health_due - steady_clock::now());
    if (watchdog) wait = std::min(wait, *watchdog);
    if (stop.wait_for(std::clamp(wait, milliseconds(0), milliseconds(kPoll)))) return Ended::stopped;
    if (restart_wanted(desk, settings, begin)) return Ended::restart;
    if (watchdog && !service.stuck(kHangLimit)) notify_watchdog();
    if (steady_clock::now() < health_due) continue;
    service.send_health();
    notify_status(desk.fusion_seen() ? service.condition() : "fusion has not been found yet");
    health_due = steady_clock::now() + health_period;
  }
}

struct Parts {
  Rig rig;
  const CameraModel* camera = nullptr;  // in the rig
  EdgeMethod method = EdgeMethod::best;
  std::unique_ptr<FrameSource> source;
  bool replay = false;
};

// A camera whose size is not told is set to that of its calibration.
CameraSettings camera_settings(const NodeConfig& config, const CameraModel& calibrated) {
  CameraSettings settings = config.camera;
  if (settings.width_px != 0) return settings;
  settings.width_px = calibrated.width_px;
  settings.height_px = calibrated.height_px;
  return settings;
}

Result<std::unique_ptr<FrameSource>> open_source(const NodeConfig& config, const CameraModel& calibrated) {
  if (config.capture_source == "imprints") return open_imprint_replay(config.capture_path, config.camera_id);
  if (has_camera(config))
    return open_camera_source(config.capture_source, camera_settings(config, calibrated), config.camera_id);
  return open_frame_source(config.capture_source, config.capture_path, config.camera_id);
}

// A camera is only opened to be used: two at a time would disturb each other.
enum class Purpose { check, measure };

// Everything the config names, opened; fails as the node would with it.
Result<std::unique_ptr<Parts>> open_parts(const std::filesystem::path& file, const NodeConfig& config,
                                          Purpose purpose) {
  auto parts = std::make_unique<Parts>();
  auto rig = read_rig(config.rig);
  if (!rig) return pass_on(rig.error());
  parts->rig = std::move(*rig);
  parts->camera = parts->rig.find_camera(config.camera_id);
  if (parts->camera == nullptr) {
    return invalid_input("{}: node.camera_id: \"{}\" is no camera of {}", file.string(), config.camera_id,
                         config.rig.string());
  }
  const auto method = edge_method_from_name(config.method);
  if (!method) return pass_on(method.error());
  parts->method = *method;
  parts->replay = config.capture_source == "imprints";
  if (purpose == Purpose::check && has_camera(config)) return parts;
  auto source = open_source(config, *parts->camera);
  if (!source) return pass_on(source.error());
  parts->source = std::move(*source);
  return parts;
}

// A router that refuses this node's certificate cannot tell its own people whose it was: the node says it here, once a
// minute.
ZenohConfig saying_who_does_not_let_in(ZenohConfig zenoh) {
  if (zenoh.identity.empty()) return zenoh;
  zenoh.on_peer = [name = certificate_name(zenoh.identity), identity = zenoh.identity.string(),
                   due = steady_clock::time_point{},
                   mutex = std::make_shared<std::mutex>()](const PeerNotice& notice) mutable {
    if (notice.kind != PeerNotice::Kind::not_let_in) return;
    const std::lock_guard lock(*mutex);
    if (steady_clock::now() < due) return;
    due = steady_clock::now() + std::chrono::minutes(1);
    spdlog::error("not let in at {}; own certificate {} in {}", notice.detail, name, identity);
  };
  return zenoh;
}

Result<Ended> measure(const ProgramOptions& options, const toml::table& own_table, const NodeConfig& config,
                      RemoteSettings& settings, StopSignal& stop) {
  const auto parts = open_parts(options.config, config, Purpose::measure);
  if (!parts) return pass_on(parts.error());
  for (const std::string& warning : (*parts)->rig.warnings) spdlog::warn("{}", warning);
  auto transport = open_zenoh(saying_who_does_not_let_in(config.zenoh));
  if (!transport) return pass_on(transport.error());
  PoseKeeper keeper;  // called by the service's one worker alone
  LastFrame last_frame;
  ForgingLook eye((*parts)->rig, *(*parts)->camera);  // as the keeper
  NodeService service(
      config, *(*parts)->source,
      [&](const Frame& frame) {
        if ((*parts)->replay) return replayed_imprint(frame);
        last_frame.begin(frame);
        ProcessedFrame found = process_frame(frame, *(*parts)->camera, (*parts)->rig, (*parts)->method, &keeper);
        last_frame.keep(frame, found);
        eye.learn(found);
        return found;
      },
      **transport, [&](const Frame& frame) { return eye.see(frame); });
  if (auto started = service.start(); !started) return pass_on(started.error());
  const auto keys = Keys::of(config.site, config.line);
  if (!keys) return pass_on(keys.error());
  const auto check = [&](const NodeConfig& other) -> Result<void> {
    const auto opened = open_parts(options.config, other, Purpose::check);
    if (!opened) return pass_on(opened.error());
    return {};
  };
  const auto desk = NodeDesk::open(**transport, *keys, {config, own_table, options.config, check, IMPRINT_VERSION},
                                   settings, last_frame);
  if (!desk) return pass_on(desk.error());
  spdlog::info("camera {} of {}/{} ready, frames from {} {}", config.camera_id, config.site, config.line,
               config.capture_source, has_camera(config) ? config.camera.device : config.capture_path.string());
  notify_ready("camera " + config.camera_id + " ready");
  const Ended ended = attend(service, **desk, settings, stop, config.health_period_s);
  if (ended == Ended::stopped) notify_stopping();
  service.stop();
  return ended;
}

// This program again, in the same process: the service manager need not know.
[[noreturn]] void start_anew(char** argv) {
  ::execv("/proc/self/exe", argv);
  spdlog::error("cannot start anew: {}", std::strerror(errno));
  std::_Exit(1);
}

Result<void> run(const ProgramOptions& options, char** argv) {
  StopSignal stop;
  const auto own_table = read_program_config(options);
  if (!own_table) return pass_on(own_table.error());
  const auto own_config = read_node_config(options.config, *own_table);
  if (!own_config) return pass_on(own_config.error());
  if (options.print_config) {
    std::cout << to_toml(*own_config);
    return {};
  }
  if (options.check) {
    if (const auto parts = open_parts(options.config, *own_config, Purpose::check); !parts)
      return pass_on(parts.error());
    std::cout << options.config.string() << ": OK\n";
    return {};
  }
  if (auto opened = open_log("imprint-node", own_config->log_level); !opened) return opened;
  auto settings = RemoteSettings::open(own_config->data_dir / own_config->camera_id);
  if (!settings) return pass_on(settings.error());
  toml::table table = *own_table;
  const auto begin = [&]() -> Result<Ended> {
    if (auto laid = settings->lay_over(table); !laid) return pass_on(laid.error());
    const auto config = read_node_config(options.config, table);
    if (!config) return pass_on(config.error());
    return measure(options, *own_table, *config, *settings, stop);
  };
  const auto ended = begin();
  if (!ended && settings->on_trial()) {
    settings->roll_back(ended.error().message);
    start_anew(argv);
  }
  if (!ended) return pass_on(ended.error());
  if (*ended == Ended::restart) start_anew(argv);
  spdlog::info("node stopped");
  return {};
}

}  // namespace
}  // namespace imprint

int main(int argc, char** argv) {
  // A frame's images go back to the system at once, rather than to heaps that keep what they have grown to.
  ::mallopt(M_MMAP_THRESHOLD, 256 * 1024);
  imprint::ProgramOptions options;
  if (const auto status = imprint::parse_program_options(
          argc, argv, "imprint-node", "Measures what one camera sees and sends its imprints to fusion", options)) {
    return *status;
  }
  return imprint::exit_status_of("imprint-node", [&] { return imprint::run(options, argv); });
}
