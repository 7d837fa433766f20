#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace imprint {

/// Tells systemd how this service is (sd_notify); without systemd these do nothing.
void notify_ready(const std::string& status);
void notify_stopping();
void notify_watchdog();
/// How often `notify_watchdog` is due, half of what the unit's WatchdogSec allows; none: no watchdog is set.
std::optional<std::chrono::milliseconds> watchdog_period();

}  // namespace imprint
