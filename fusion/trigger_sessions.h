#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "lib/result/result.h"
#include "lib/wire/wire.h"

namespace imprint {

/// How triggers that name no session, those of a machine, become sessions. All ours.
struct SessionPlan {
  std::string session;              // sessions are named <this>-<time of their first observation>
  int observations = 1;             // of a session; the trigger after the last begins the next session
  double rotation_step_deg = 60.0;  // between two observations
  double new_session_s = 120.0;     // a pause this long begins a new session: a forging was taken away half measured

  [[nodiscard]] Result<void> validate() const;
};

/// Which observation of which session a trigger is.
class TriggerSessions {
 public:
  using Time = std::chrono::steady_clock::time_point;
  explicit TriggerSessions(SessionPlan plan) : plan_(std::move(plan)) {}

  Trigger next(Time now, std::int64_t wall_ns);

 private:
  SessionPlan plan_;
  std::string session_;
  std::uint32_t taken_ = 0;
  Time last_;
};

}  // namespace imprint
