#include <cmath>
#include <iostream>

#include "lib/daemon/program.h"
#include "lib/daemon/stop_signal.h"
#include "lib/daemon/systemd_notice.h"
#include "lib/log/log.h"
#include "node/node_config.h"
#include "node/node_service.h"
#include "node/replay/imprint_replay.h"

namespace imprint {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr auto kHangLimit = std::chrono::seconds(60);  // a frame takes a second, a simulated one six

// Until told to stop: health when it is due, the watchdog as long as the worker gets on.
void attend(NodeService& service, StopSignal& stop, double health_period_s) {
  const auto health_period = milliseconds(std::llround(1000.0 * health_period_s));
  const auto watchdog = watchdog_period();
  auto health_due = steady_clock::now() + health_period;
  while (true) {
    auto wait = std::chrono::ceil<milliseconds>(health_due - steady_clock::now());
    if (watchdog) wait = std::min(wait, *watchdog);
    if (stop.wait_for(std::max(wait, milliseconds(0)))) return;
    if (watchdog && !service.stuck(kHangLimit)) notify_watchdog();
    if (steady_clock::now() < health_due) continue;
    service.send_health();
    health_due = steady_clock::now() + health_period;
  }
}

Result<void> run(const ProgramOptions& options) {
  StopSignal stop;
  const auto table = read_program_config(options);
  if (!table) return pass_on(table.error());
  const auto config = read_node_config(options.config, *table);
  if (!config) return pass_on(config.error());
  if (options.print_config) {
    std::cout << to_toml(*config);
    return {};
  }
  const auto rig = read_rig(config->rig);
  if (!rig) return pass_on(rig.error());
  const CameraModel* camera = rig->find_camera(config->camera_id);
  if (camera == nullptr) {
    return invalid_input("{}: node.camera_id: \"{}\" is no camera of {}", options.config.string(), config->camera_id,
                         config->rig.string());
  }
  const auto method = edge_method_from_name(config->method);
  if (!method) return pass_on(method.error());
  const bool replay = config->capture_source == "imprints";
  const auto source = replay ? open_imprint_replay(config->capture_path, config->camera_id)
                             : open_frame_source(config->capture_source, config->capture_path, config->camera_id);
  if (!source) return pass_on(source.error());
  if (options.check) {
    std::cout << options.config.string() << ": OK\n";
    return {};
  }
  if (auto opened = open_log("imprint-node", config->log_level); !opened) return opened;
  for (const std::string& warning : rig->warnings) spdlog::warn("{}", warning);
  auto transport = open_zenoh(config->zenoh);
  if (!transport) return pass_on(transport.error());
  PoseKeeper keeper;  // called by the service's one worker alone
  NodeService service(
      *config, **source,
      [&](const Frame& frame) {
        return replay ? replayed_imprint(frame) : process_frame(frame, *camera, *rig, *method, &keeper);
      },
      **transport);
  if (auto started = service.start(); !started) return started;
  spdlog::info("camera {} of {}/{} ready, frames from {} {}", config->camera_id, config->site, config->line,
               config->capture_source, config->capture_path.string());
  notify_ready("camera " + config->camera_id + " ready");
  attend(service, stop, config->health_period_s);
  notify_stopping();
  service.stop();
  spdlog::info("camera {} stopped", config->camera_id);
  return {};
}

}  // namespace
}  // namespace imprint

int main(int argc, char** argv) {
  imprint::ProgramOptions options;
  if (const auto status = imprint::parse_program_options(
          argc, argv, "imprint-node", "Measures what one camera sees and sends its imprints to fusion", options)) {
    return *status;
  }
  return imprint::exit_status_of("imprint-node", [&] { return imprint::run(options); });
}
