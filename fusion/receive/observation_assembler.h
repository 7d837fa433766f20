#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "fusion/receive/observation.h"
#include "lib/imprint/imprint.h"
#include "lib/result/result.h"
#include "lib/wire/wire.h"

namespace imprint {

struct AssemblerConfig {
  double deadline_s = 10.0;       // from the first sign of an observation to its evaluation without the rest; ours
  std::size_t max_sessions = 16;  // sessions held in memory; a settled one longest untouched leaves first; ours
  std::uint32_t max_observations = 64;  // of one session; ours
  double max_spread_s = 1.0;            // between the frames of one observation; further apart is a warning; ours
  double max_clock_offset_s = 1.0;      // of a node's clock from fusion's; more is a warning and an alarm; ours

  [[nodiscard]] Result<void> validate() const;
};

/// What an imprint does not say itself.
struct Circumstances {
  bool late = false;                              ///< its observation had been evaluated without it
  std::optional<std::int64_t> clock_offset_ns{};  ///< its node's clock minus fusion's, where it was known
};

/// What became of an imprint.
enum class Arrival {
  taken,           ///< the camera's first for this observation
  replaced,        ///< stands in place of the camera's failed imprint
  repeated,        ///< the very same imprint once more: dropped
  surplus,         ///< the camera has already answered this observation, at least as well: dropped
  unknown_camera,  ///< the rig has no such camera: dropped
  refused,         ///< observation index beyond `max_observations`: dropped
};
std::string_view arrival_name(Arrival arrival);

/// Where one observation stands.
struct ObservationState {
  int index = 0;
  double rotation_deg = 0.0;
  bool settled = false;               ///< evaluated: every camera has reported or the deadline has passed
  std::vector<std::string> reported;  ///< cameras with an imprint, good or failed
  std::vector<std::string> waiting;   ///< cameras without one
  bool triggered = false;             ///< its trigger is here; else it is known by its imprints alone
};

/// Groups imprints by session and observation. Knows no clock: `now` comes from outside and never goes back.
///
/// - An observation opens with its trigger or, where that is late or lost, with its first imprint. It settles when
///   every camera of the rig has reported (a failed imprint is a report) or `deadline_s` later.
/// - The trigger's rotation counts; an imprint's only as long as no trigger was seen.
/// - A camera's first good imprint stands: a node that was restarted and answers again cannot change a result, for
///   the forging may have been moved since. A failed imprint gives way to any later one.
/// - An imprint that comes after its observation has settled is taken, and the session is due again.
/// - A session is complete when all `observations_expected` have settled; not before a trigger has said how many.
class ObservationAssembler {
 public:
  using Time = std::chrono::steady_clock::time_point;

  ObservationAssembler(std::vector<std::string> camera_ids, AssemblerConfig config);

  /// What `add` would refuse the trigger for.
  [[nodiscard]] Result<void> check(const Trigger& trigger) const;
  /// Fails (invalid_input) on an observation beyond `max_observations`. A repeated trigger changes nothing but an
  /// unknown number of expected observations.
  Result<void> add(const Trigger& trigger, Time now);
  Arrival add(const Imprint& imprint, Time now, const Circumstances& circumstances = {});
  /// Whether the imprint comes when its observation has been, or is to be, evaluated without its camera.
  [[nodiscard]] bool is_late(const Imprint& imprint, Time now) const;
  /// Whether a camera is connected; only for the words of `Observation::missing`.
  void set_alive(const std::string& camera_id, bool alive);

  /// Settles what is due and gives the sessions whose result has to be made (again), the longest waiting first.
  std::vector<std::string> settle(Time now);
  /// When the next observation runs out of time.
  [[nodiscard]] std::optional<Time> next_deadline() const;

  [[nodiscard]] bool knows(const std::string& session) const { return sessions_.contains(session); }
  /// The settled observations, by index.
  [[nodiscard]] std::vector<Observation> observations(const std::string& session) const;
  [[nodiscard]] bool complete(const std::string& session) const;
  /// What the receiving noticed: repeated answers, contradicting rotations, a missing trigger, imprints that came late,
  /// clocks that are off, frames that were not taken at the same time.
  [[nodiscard]] std::vector<std::string> warnings(const std::string& session) const;
  [[nodiscard]] std::uint32_t expected(const std::string& session) const;
  [[nodiscard]] std::vector<ObservationState> states(const std::string& session) const;
  /// Triggers of observations that have not settled and still lack an imprint of this camera.
  [[nodiscard]] std::vector<Trigger> open_triggers(const std::string& camera_id) const;
  [[nodiscard]] std::vector<std::string> sessions() const;
  /// Sessions that had to leave for want of room before their result was made; each is given once. Whoever keeps their
  /// messages brings them back when `has_room`.
  std::vector<std::string> take_displaced() { return std::exchange(displaced_, {}); }
  /// Whether a session more would displace none that waits for its result.
  [[nodiscard]] bool has_room() const;

 private:
  struct Pending {
    std::optional<Trigger> trigger;
    double rotation_deg = 0.0;
    Time deadline;
    std::map<std::string, Imprint> imprints;  // by camera
    std::map<std::string, Circumstances> circumstances;
    bool settled = false;
    std::map<std::string, std::string> why_missing;  // frozen when it settled
  };
  struct Session {
    std::map<std::uint32_t, Pending> observations;
    std::uint32_t expected = 0;
    Time touched;
    bool due = false;
    std::set<std::string> warnings;
  };

  [[nodiscard]] static bool is_open(const Session& session);
  Session& open_session(const std::string& name, Time now);
  Pending& open_observation(Session& session, std::uint32_t index, double rotation_deg, Time now);
  [[nodiscard]] const Session* find(const std::string& session) const;
  [[nodiscard]] std::vector<std::string> waiting_for(const Pending& observation) const;
  void warn_of_times(std::uint32_t index, const Pending& observation, std::vector<std::string>& warnings) const;
  [[nodiscard]] std::string reason_missing(const std::string& camera_id) const;

  std::vector<std::string> camera_ids_;
  AssemblerConfig config_;
  std::set<std::string> alive_;
  std::map<std::string, Session> sessions_;
  std::vector<std::string> displaced_;
};

}  // namespace imprint
