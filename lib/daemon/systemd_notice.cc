#include "lib/daemon/systemd_notice.h"

#include <systemd/sd-daemon.h>

namespace imprint {

void notify_ready(const std::string& status) { sd_notify(0, ("READY=1\nSTATUS=" + status).c_str()); }

void notify_status(const std::string& status) { sd_notify(0, ("STATUS=" + status).c_str()); }

void notify_stopping() { sd_notify(0, "STOPPING=1"); }

void notify_watchdog() { sd_notify(0, "WATCHDOG=1"); }

std::optional<std::chrono::milliseconds> watchdog_period() {
  std::uint64_t period_us = 0;
  if (sd_watchdog_enabled(0, &period_us) <= 0) return std::nullopt;
  return std::chrono::milliseconds(period_us / 2000);
}

bool LoopWatchdog::attend() {
  std::vector<std::uint64_t> turns;
  for (const Turns& loop : loops_) turns.push_back(loop());
  for (std::size_t i = 0; i < told_at_.size(); ++i)
    if (told_at_[i] == turns[i]) return false;
  told_at_ = std::move(turns);
  notify_watchdog();
  return true;
}

}  // namespace imprint
