#include "fusion/rest_trigger.h"

#include <cmath>

namespace imprint {

Result<void> RestTriggerConfig::validate() const {
  if (auto valid = plan.validate(); !valid) return valid;
  if (!(lead_ms >= 0.0 && lead_ms <= 10'000.0)) return invalid_input("lead_ms: expected 0 to 10000, found {}", lead_ms);
  if (!(quiet_s >= 0.0 && quiet_s <= 3600.0)) return invalid_input("quiet_s: expected 0 to 3600, found {}", quiet_s);
  return {};
}

std::optional<Trigger> RestTrigger::note(Time now, std::int64_t wall_ns) {
  if (!config_.accept) return std::nullopt;
  if (fired_ && now - *fired_ < std::chrono::duration<double>(config_.quiet_s)) return std::nullopt;
  fired_ = now;
  Trigger trigger = sessions_.next(now, wall_ns);
  trigger.fire_at_ns = wall_ns + std::llround(1e6 * config_.lead_ms);
  return trigger;
}

}  // namespace imprint
