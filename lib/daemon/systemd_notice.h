#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace imprint {

/// Tells systemd how this service is (sd_notify); without systemd these do nothing.
void notify_ready(const std::string& status);
void notify_stopping();
void notify_watchdog();
/// How often `notify_watchdog` is due, half of what the unit's WatchdogSec allows; none: no watchdog is set.
std::optional<std::chrono::milliseconds> watchdog_period();

/// The watchdog of a loop in another thread: systemd is told that all is well only when the loop has turned since it
/// was last told. A loop that hangs lets the watchdog run out, and systemd starts the service anew.
class LoopWatchdog {
 public:
  /// `turns` counts the loop's turns; it is called by `attend` only.
  explicit LoopWatchdog(std::function<std::uint64_t()> turns) : turns_(std::move(turns)) {}
  /// Due every `watchdog_period`. False when the loop has not turned.
  bool attend();

 private:
  std::function<std::uint64_t()> turns_;
  std::optional<std::uint64_t> told_at_;  // turns when systemd was last told
};

}  // namespace imprint
