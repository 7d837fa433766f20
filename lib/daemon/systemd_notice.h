#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace imprint {

/// Tells systemd how this service is (sd_notify); without systemd these do nothing.
void notify_ready(const std::string& status);
void notify_stopping();
/// One line that `systemctl status` shows.
void notify_status(const std::string& status);
void notify_watchdog();
/// How often `notify_watchdog` is due, half of what the unit's WatchdogSec allows; none: no watchdog is set.
std::optional<std::chrono::milliseconds> watchdog_period();

/// The watchdog of loops in other threads: systemd is told that all is well only when each loop has turned since it
/// was last told. One that hangs lets the watchdog run out, and systemd starts the service anew.
class LoopWatchdog {
 public:
  using Turns = std::function<std::uint64_t()>;
  /// Each counts the turns of one loop; called by `attend` only.
  explicit LoopWatchdog(std::vector<Turns> loops) : loops_(std::move(loops)) {}
  /// Due every `watchdog_period`. False when a loop has not turned.
  bool attend();

 private:
  std::vector<Turns> loops_;
  std::vector<std::uint64_t> told_at_;  // turns of each when systemd was last told; empty: never
};

}  // namespace imprint
