#include <algorithm>
#include <iostream>

#include "fusion/access_file.h"
#include "fusion/fusion_config.h"
#include "fusion/fusion_line.h"
#include "fusion/peer_log.h"
#include "lib/access/identity.h"
#include "lib/daemon/program.h"
#include "lib/daemon/stop_signal.h"
#include "lib/daemon/systemd_notice.h"
#include "lib/log/log.h"

namespace imprint {
namespace {

using Lines = std::vector<std::unique_ptr<FusionLine>>;  // the first one's config is the program's own

constexpr auto kIdleWait = std::chrono::milliseconds(1000);

enum class Ended { stopped, access_changed };

// Until told to stop, or the access list is another: the watchdog as long as the worker of every line gets on.
Ended attend(const Lines& lines, AccessFile& access, StopSignal& stop) {
  const auto period = watchdog_period();
  const auto wait = std::min(period.value_or(kIdleWait), kIdleWait);
  std::vector<LoopWatchdog::Turns> loops;
  for (const auto& line : lines) loops.emplace_back([&line] { return line->turns(); });
  LoopWatchdog watchdog(std::move(loops));
  bool hung = false;
  auto watchdog_due = std::chrono::steady_clock::now() + period.value_or(kIdleWait);
  while (!stop.wait_for(wait)) {
    if (access.changed()) return Ended::access_changed;
    if (!period || std::chrono::steady_clock::now() < watchdog_due) continue;
    watchdog_due += *period;
    const bool turned = watchdog.attend();
    if (!turned && !hung)
      spdlog::error("a worker has not turned for {} ms; systemd is not told that all is well", period->count());
    hung = !turned;
  }
  return Ended::stopped;
}

// One life of the connections. Only a new session takes new access rules; nodes keep what they send meanwhile.
Result<Ended> serve(const Lines& lines, AccessFile& access, StopSignal& stop) {
  ZenohConfig zenoh = lines.front()->config().zenoh;
  auto rules = access.rules();
  if (!rules) return pass_on(rules.error());
  zenoh.access = std::move(*rules);
  const auto peers = std::make_shared<PeerLog>(access.list(), lines.front()->board(), certificate_name(zenoh.identity));
  if (!zenoh.listen.empty()) zenoh.on_peer = [peers](const PeerNotice& notice) { peers->note(notice); };
  auto transport = open_zenoh(zenoh);
  if (!transport) return pass_on(transport.error());
  const auto run = [&]() -> Result<Ended> {
    for (const auto& line : lines) {
      if (auto connected = line->connect(**transport); !connected) return pass_on(connected.error());
    }
    notify_ready("fusion ready");
    return attend(lines, access, stop);
  };
  const auto ended = run();
  if (ended && *ended == Ended::stopped) notify_stopping();
  for (const auto& line : lines) line->disconnect();
  return ended;
}

// The other files of `fusion.lines`, each one more line over the first one's connections.
Result<FusionConfig> read_further_line(const std::filesystem::path& file) {
  const auto table = parse_toml_file(file);
  if (!table) return pass_on(table.error());
  if (table->contains("zenoh"))
    return invalid_input("{}: zenoh: expected in the program's own config alone, which all its lines are reached by",
                         file.string());
  auto config = read_fusion_config(file, *table);
  if (config && !config->lines.empty())
    return invalid_input("{}: fusion.lines: expected in the program's own config alone", file.string());
  return config;
}

Result<Lines> read_lines(FusionConfig own) {
  Lines lines;
  const auto add = [&](FusionConfig config) -> Result<void> {
    auto line = FusionLine::read(std::move(config));
    if (!line) return pass_on(line.error());
    for (const auto& other : lines)
      if (other->name() == (*line)->name())
        return invalid_input("fusion.lines: {} is there twice: give each its own fusion.line", other->name());
    lines.push_back(std::move(*line));
    return {};
  };
  const auto files = own.lines;
  if (auto added = add(std::move(own)); !added) return pass_on(added.error());
  for (const auto& file : files) {
    auto config = read_further_line(file);
    if (!config) return pass_on(config.error());
    if (auto added = add(std::move(*config)); !added) return pass_on(added.error());
  }
  return lines;
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
  const auto lines = read_lines(*config);
  if (!lines) return pass_on(lines.error());
  AccessFile access(config->access);
  if (auto rules = access.rules(); !rules) return pass_on(rules.error());
  if (options.check) {
    for (const auto& line : *lines)
      if (auto checked = line->check(); !checked) return checked;
    std::cout << options.config.string() << ": OK\n";
    return {};
  }
  if (auto opened = open_log("imprint-fusion", config->log_level); !opened) return opened;
  for (const auto& line : *lines)
    if (auto opened = line->open(); !opened) return opened;
  while (true) {
    const auto ended = serve(*lines, access, stop);
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
