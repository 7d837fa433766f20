#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "fusion/trigger_sessions.h"
#include "lib/result/result.h"

namespace imprint {

/// Whether nodes that see the forging come to rest may make all cameras fire; `[rest]` of fusion.toml. All ours.
struct RestTriggerConfig {
  bool accept = false;
  SessionPlan plan{.session = "rest"};
  double lead_ms = 300.0;  // from the node's word to the moment all cameras fire: the trigger must have reached them
  double quiet_s = 5.0;    // in which another camera means the same rest

  [[nodiscard]] Result<void> validate() const;
};

/// Turns nodes' words that the forging rests into triggers, one for each time it comes to rest.
class RestTrigger {
 public:
  using Time = TriggerSessions::Time;
  explicit RestTrigger(const RestTriggerConfig& config) : config_(config), sessions_(config.plan) {}

  /// What to fire, at one moment of fusion's clock; nothing when the rest was told before, or none is accepted.
  std::optional<Trigger> note(Time now, std::int64_t wall_ns);

 private:
  RestTriggerConfig config_;
  TriggerSessions sessions_;
  std::optional<Time> fired_;
};

}  // namespace imprint
