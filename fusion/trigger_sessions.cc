#include "fusion/trigger_sessions.h"

#include "lib/clock/wall_clock.h"
#include "lib/wire/keys.h"

namespace imprint {
namespace {

constexpr std::size_t kMaxSessionBytes = 32;  // the time comes behind it

}  // namespace

Result<void> SessionPlan::validate() const {
  if (auto valid = check_id("session", session); !valid) return valid;
  if (session.size() > kMaxSessionBytes)
    return invalid_input("session: expected at most {} characters, found {}", kMaxSessionBytes, session.size());
  if (observations < 1 || observations > 64)
    return invalid_input("observations: expected 1 to 64, found {}", observations);
  if (!(rotation_step_deg >= -360.0 && rotation_step_deg <= 360.0))
    return invalid_input("rotation_step_deg: expected -360 to 360, found {}", rotation_step_deg);
  if (!(new_session_s > 0.0 && new_session_s <= 86'400.0))
    return invalid_input("new_session_s: expected more than 0, at most 86400, found {}", new_session_s);
  return {};
}

Trigger TriggerSessions::next(Time now, std::int64_t wall_ns) {
  const bool over = taken_ >= static_cast<std::uint32_t>(plan_.observations);
  const bool left = now - last_ >= std::chrono::duration<double>(plan_.new_session_s);
  if (session_.empty() || over || left) {
    std::string time = utc_text(wall_ns).substr(0, 23);  // 2025-12-31T23:59:59.999
    std::erase_if(time, [](char c) { return c == '-' || c == ':'; });
    session_ = plan_.session + '-' + time;
    taken_ = 0;
  }
  last_ = now;
  Trigger trigger;
  trigger.session = session_;
  trigger.observation = taken_;
  trigger.rotation_deg = plan_.rotation_step_deg * taken_;
  trigger.observations_expected = static_cast<std::uint32_t>(plan_.observations);
  ++taken_;
  return trigger;
}

}  // namespace imprint
