#include <iostream>

#include "fusion/access_file.h"
#include "fusion/fusion_config.h"
#include "fusion/fusion_service.h"
#include "fusion/peer_log.h"
#include "fusion/serve/page_server.h"
#include "fusion/store/session_store.h"
#include "lib/daemon/program.h"
#include "lib/daemon/stop_signal.h"
#include "lib/daemon/systemd_notice.h"
#include "lib/log/log.h"
#include "lib/service/document_desk.h"
#include "lib/service/log_document.h"

namespace imprint {
namespace {

constexpr auto kIdleWait = std::chrono::milliseconds(1000);

enum class Ended { stopped, access_changed };

// Until told to stop, or the access list is another: the watchdog as long as the worker gets on.
Ended attend(const FusionService& service, AccessFile& access, StopSignal& stop) {
  const auto period = watchdog_period();
  const auto wait = std::min(period.value_or(kIdleWait), kIdleWait);
  LoopWatchdog watchdog([&] { return service.turns(); });
  bool hung = false;
  auto watchdog_due = std::chrono::steady_clock::now() + period.value_or(kIdleWait);
  while (!stop.wait_for(wait)) {
    if (access.changed()) return Ended::access_changed;
    if (!period || std::chrono::steady_clock::now() < watchdog_due) continue;
    watchdog_due += *period;
    const bool turned = watchdog.attend();
    if (!turned && !hung)
      spdlog::error("the worker has not turned for {} ms; systemd is not told that all is well", period->count());
    hung = !turned;
  }
  return Ended::stopped;
}

// A folder, or a name that is free.
Result<void> check_result_dir(const FusionConfig& config) {
  std::error_code ignored;
  if (config.result_dir.empty() || std::filesystem::is_directory(config.result_dir, ignored)) return {};
  if (!std::filesystem::exists(config.result_dir, ignored)) return {};
  return invalid_input("fusion.result_dir: {}: expected a folder, found a file", config.result_dir.string());
}

// One life of the connections. Only a new session takes new access rules; nodes keep what they send meanwhile.
Result<Ended> serve(const FusionConfig& config, const Rig& rig, AccessFile& access, SessionStore& store,
                    LineBoard& board, LineControl& control, StopSignal& stop) {
  ZenohConfig zenoh = config.zenoh;
  auto rules = access.rules();
  if (!rules) return pass_on(rules.error());
  zenoh.access = std::move(*rules);
  const auto peers = std::make_shared<PeerLog>(access.list(), board);
  if (!zenoh.listen.empty()) zenoh.on_peer = [peers](const PeerNotice& notice) { peers->note(notice); };
  auto transport = open_zenoh(zenoh);
  if (!transport) return pass_on(transport.error());
  FusionService service(config, rig, **transport, store, board,
                        [geometry = config.geometry](const auto& observations, const ForgingSpec& forging,
                                                     std::string session, std::string method) {
                          return fuse(observations, forging, std::move(session), std::move(method), geometry);
                        });
  if (auto started = service.start(); !started) return pass_on(started.error());
  spdlog::info("fusion of {}/{} ready, {} cameras", config.site, config.line, rig.cameras.size());
  notify_ready("fusion ready");
  const auto keys = Keys::of(config.site, config.line);
  if (!keys) return pass_on(keys.error());
  const auto desk = DocumentDesk::open(**transport, {{keys->fusion_service("log"), log_document}});
  if (!desk) return pass_on(desk.error());
  control.connect([&](const Trigger& trigger) { return service.fire(trigger); });
  const Ended ended = attend(service, access, stop);
  if (ended == Ended::stopped) notify_stopping();
  control.disconnect();
  service.stop();
  for (const CameraModel& camera : rig.cameras) board.set_alive(camera.id, false);  // who is let in again says so
  return ended;
}

Result<void> run(const ProgramOptions& options) {
  StopSignal stop;
  const auto table = read_program_config(options);
  if (!table) return pass_on(table.error());
  const auto config = read_fusion_config(options.config, *table);
  if (!config) return pass_on(config.error());
  if (options.print_config) {
    std::cout << to_toml(*config);
    return {};
  }
  const auto rig = read_rig(config->rig);
  if (!rig) return pass_on(rig.error());
  if (auto checked = check_result_dir(*config); !checked) return checked;
  AccessFile access(config->access);
  if (auto rules = access.rules(); !rules) return pass_on(rules.error());
  if (options.check) {
    if (auto checked = SessionStore::check(config->database); !checked) return checked;
    std::cout << options.config.string() << ": OK\n";
    return {};
  }
  if (auto opened = open_log("imprint-fusion", config->log_level); !opened) return opened;
  for (const std::string& warning : rig->warnings) spdlog::warn("{}", warning);
  const auto store = SessionStore::open(config->database);
  if (!store) return pass_on(store.error());

  std::vector<std::string> camera_ids;
  for (const CameraModel& camera : rig->cameras) camera_ids.push_back(camera.id);
  LineBoard board({config->site, config->line, config->method, IMPRINT_VERSION}, camera_ids,
                  std::chrono::steady_clock::now(), config->alarms);
  LineControl control;
  const auto page = PageServer::start(config->page, board, **store, control);
  if (!page) return pass_on(page.error());
  spdlog::info("page {}://{}:{}/", config->page.identity.empty() ? "http" : "https", config->page.address,
               (*page)->port());
  std::unique_ptr<PlcInput> plc;
  if (!config->plc.input.empty()) {
    auto started = PlcInput::start(config->plc, control);
    if (!started) return pass_on(started.error());
    plc = std::move(*started);
  }
  while (true) {
    const auto ended = serve(*config, *rig, access, **store, board, control, stop);
    if (!ended) return pass_on(ended.error());
    if (*ended == Ended::stopped) break;
    spdlog::info("{}: changed; connections are made anew by it", config->access.string());
  }
  spdlog::info("fusion stopped");
  return {};
}

}  // namespace
}  // namespace imprint

int main(int argc, char** argv) {
  imprint::ProgramOptions options;
  if (const auto status = imprint::parse_program_options(
          argc, argv, "imprint-fusion", "Fuses the imprints of a line's cameras into the geometry of the forging",
          options)) {
    return *status;
  }
  return imprint::exit_status_of("imprint-fusion", [&] { return imprint::run(options); });
}
