#include "fusion/receive/observation_assembler.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

constexpr double kSameRotationDeg = 1e-3;  // far below what a turning device can set, far above rounding on the wire

std::chrono::steady_clock::duration seconds(double s) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(s));
}

/// Whether `next` may stand in the place of `held`, both of one camera and one observation.
bool supersedes(const Imprint& next, const Imprint& held) {
  if (held.failure.empty()) return false;
  if (next.failure.empty()) return true;
  return next.boot_id != held.boot_id || next.sequence > held.sequence;
}

}  // namespace

Result<void> AssemblerConfig::validate() const {
  if (!(deadline_s > 0.0 && deadline_s <= 3600.0)) {
    return invalid_input("deadline_s: expected more than 0 and at most 3600, found {}", deadline_s);
  }
  if (!(max_spread_s > 0.0 && max_spread_s <= 3600.0)) {
    return invalid_input("max_spread_s: expected more than 0 and at most 3600, found {}", max_spread_s);
  }
  if (!(max_clock_offset_s > 0.0 && max_clock_offset_s <= 3600.0)) {
    return invalid_input("max_clock_offset_s: expected more than 0 and at most 3600, found {}", max_clock_offset_s);
  }
  if (max_sessions < 1) return invalid_input("max_sessions: expected at least 1, found 0");
  if (max_observations < 1) return invalid_input("max_observations: expected at least 1, found 0");
  return {};
}

std::string_view arrival_name(Arrival arrival) {
  switch (arrival) {
    case Arrival::taken:
      return "taken";
    case Arrival::replaced:
      return "replaced";
    case Arrival::repeated:
      return "repeated";
    case Arrival::surplus:
      return "surplus";
    case Arrival::unknown_camera:
      return "unknown camera";
    case Arrival::refused:
      return "refused";
  }
  return "refused";
}

ObservationAssembler::ObservationAssembler(std::vector<std::string> camera_ids, AssemblerConfig config)
    : camera_ids_(std::move(camera_ids)), config_(config) {}

Result<void> ObservationAssembler::check(const Trigger& trigger) const {
  if (trigger.observation >= config_.max_observations || trigger.observations_expected > config_.max_observations) {
    return invalid_input("trigger of session {}: observation {} of {}, but a session has at most {}", trigger.session,
                         trigger.observation, trigger.observations_expected, config_.max_observations);
  }
  return {};
}

Result<void> ObservationAssembler::add(const Trigger& trigger, Time now) {
  if (auto valid = check(trigger); !valid) return valid;
  Session& session = open_session(trigger.session, now);
  Pending& observation = open_observation(session, trigger.observation, trigger.rotation_deg, now);
  if (trigger.observations_expected > session.expected) {
    session.expected = trigger.observations_expected;
    // Whether the session is complete may have changed, and with it what was announced.
    session.due =
        session.due || std::ranges::any_of(session.observations, [](const auto& o) { return o.second.settled; });
  }
  if (observation.trigger) {
    if (std::abs(observation.trigger->rotation_deg - trigger.rotation_deg) > kSameRotationDeg) {
      session.warnings.insert(
          fmt::format("observation {}: triggered again with rotation {} deg; {} deg of the first trigger stays",
                      trigger.observation, trigger.rotation_deg, observation.trigger->rotation_deg));
    }
    return {};
  }
  observation.trigger = trigger;
  if (std::abs(observation.rotation_deg - trigger.rotation_deg) > kSameRotationDeg) {
    session.warnings.insert(
        fmt::format("observation {}: imprints say rotation {} deg, the trigger {} deg; the trigger's is used",
                    trigger.observation, observation.rotation_deg, trigger.rotation_deg));
    observation.rotation_deg = trigger.rotation_deg;
    session.due = session.due || observation.settled;
  }
  return {};
}

Arrival ObservationAssembler::add(const Imprint& imprint, Time now, const Circumstances& circumstances) {
  if (std::ranges::find(camera_ids_, imprint.camera_id) == camera_ids_.end()) return Arrival::unknown_camera;
  if (imprint.observation >= config_.max_observations) return Arrival::refused;
  Session& session = open_session(imprint.session, now);
  Pending& observation = open_observation(session, imprint.observation, imprint.rotation_deg, now);
  if (std::abs(observation.rotation_deg - imprint.rotation_deg) > kSameRotationDeg) {
    session.warnings.insert(fmt::format("observation {}: {} says rotation {} deg, but {} deg is used",
                                        imprint.observation, imprint.camera_id, imprint.rotation_deg,
                                        observation.rotation_deg));
  }
  const auto held = observation.imprints.find(imprint.camera_id);
  if (held == observation.imprints.end()) {
    observation.imprints.emplace(imprint.camera_id, imprint);
    observation.circumstances[imprint.camera_id] = circumstances;
    observation.why_missing.erase(imprint.camera_id);
    session.due = session.due || observation.settled;
    return Arrival::taken;
  }
  if (held->second.boot_id == imprint.boot_id && held->second.sequence == imprint.sequence) return Arrival::repeated;
  if (!supersedes(imprint, held->second)) {
    if (imprint.failure.empty()) {
      session.warnings.insert(fmt::format("observation {}: {} answered more than once; its first imprint is used",
                                          imprint.observation, imprint.camera_id));
    }
    return Arrival::surplus;
  }
  held->second = imprint;
  observation.circumstances[imprint.camera_id] = circumstances;
  session.due = session.due || observation.settled;
  return Arrival::replaced;
}

bool ObservationAssembler::is_late(const Imprint& imprint, Time now) const {
  const Session* session = find(imprint.session);
  if (session == nullptr) return false;
  const auto entry = session->observations.find(imprint.observation);
  if (entry == session->observations.end()) return false;
  const Pending& observation = entry->second;
  return !observation.imprints.contains(imprint.camera_id) && (observation.settled || now >= observation.deadline);
}

void ObservationAssembler::set_alive(const std::string& camera_id, bool alive) {
  if (std::ranges::find(camera_ids_, camera_id) == camera_ids_.end()) return;
  if (alive) {
    alive_.insert(camera_id);
  } else {
    alive_.erase(camera_id);
  }
}

std::vector<std::string> ObservationAssembler::settle(Time now) {
  std::vector<std::pair<Time, std::string>> due;
  for (auto& [name, session] : sessions_) {
    for (auto& [index, observation] : session.observations) {
      if (observation.settled) continue;
      const std::vector<std::string> waiting = waiting_for(observation);
      if (!waiting.empty() && now < observation.deadline) continue;
      observation.settled = true;
      for (const std::string& camera : waiting) observation.why_missing[camera] = reason_missing(camera);
      session.due = true;
    }
    if (session.due) due.emplace_back(session.touched, name);
    session.due = false;
  }
  std::ranges::sort(due);
  std::vector<std::string> names;
  for (auto& [touched, name] : due) names.push_back(std::move(name));
  return names;
}

std::optional<ObservationAssembler::Time> ObservationAssembler::next_deadline() const {
  std::optional<Time> next;
  for (const auto& [name, session] : sessions_) {
    for (const auto& [index, observation] : session.observations) {
      if (!observation.settled && (!next || observation.deadline < *next)) next = observation.deadline;
    }
  }
  return next;
}

std::vector<Observation> ObservationAssembler::observations(const std::string& name) const {
  std::vector<Observation> settled;
  const Session* session = find(name);
  if (session == nullptr) return settled;
  for (const auto& [index, pending] : session->observations) {
    if (!pending.settled) continue;
    Observation observation{static_cast<int>(index), pending.rotation_deg, {}, {}};
    for (const std::string& camera : camera_ids_) {  // the rig's order, so that the order of arrival changes no digit
      if (const auto held = pending.imprints.find(camera); held != pending.imprints.end()) {
        observation.imprints.push_back(held->second);
        observation.imprints.back().rotation_deg = pending.rotation_deg;
      } else if (const auto why = pending.why_missing.find(camera); why != pending.why_missing.end()) {
        observation.missing.emplace_back(camera, why->second);
      }
    }
    settled.push_back(std::move(observation));
  }
  return settled;
}

bool ObservationAssembler::complete(const std::string& name) const {
  const Session* session = find(name);
  if (session == nullptr || session->expected == 0) return false;
  for (std::uint32_t index = 0; index < session->expected; ++index) {
    const auto observation = session->observations.find(index);
    if (observation == session->observations.end() || !observation->second.settled) return false;
  }
  return true;
}

std::vector<std::string> ObservationAssembler::warnings(const std::string& name) const {
  const Session* session = find(name);
  if (session == nullptr) return {};
  std::vector<std::string> warnings(session->warnings.begin(), session->warnings.end());
  for (const auto& [index, observation] : session->observations) {
    if (observation.settled && !observation.trigger) {
      warnings.push_back(fmt::format("observation {}: no trigger was received; rotation {} deg is the imprints'", index,
                                     observation.rotation_deg));
    }
    if (observation.settled) warn_of_times(index, observation, warnings);
  }
  return warnings;
}

void ObservationAssembler::warn_of_times(std::uint32_t index, const Pending& observation,
                                         std::vector<std::string>& warnings) const {
  std::vector<std::pair<double, std::string>> taken;  // s by fusion's clock since the first camera's, camera
  std::int64_t first_ns = 0;
  for (const std::string& camera : camera_ids_) {
    const auto held = observation.imprints.find(camera);
    if (held == observation.imprints.end()) continue;
    const Circumstances& circumstances = observation.circumstances.at(camera);
    if (circumstances.late) {
      warnings.push_back(
          fmt::format("observation {}: the imprint of {} came late, the result was made anew with it", index, camera));
    }
    if (!circumstances.clock_offset_ns) continue;
    const double offset_s = 1e-9 * static_cast<double>(*circumstances.clock_offset_ns);
    if (std::abs(offset_s) > config_.max_clock_offset_s) {
      warnings.push_back(
          fmt::format("observation {}: the clock of {} was {:.1f} s {} fusion's; its times were corrected", index,
                      camera, std::abs(offset_s), offset_s > 0 ? "ahead of" : "behind"));
    }
    const std::int64_t taken_ns = held->second.sensor_time_ns - *circumstances.clock_offset_ns;
    if (taken.empty()) first_ns = taken_ns;
    taken.emplace_back(1e-9 * static_cast<double>(taken_ns - first_ns), camera);
  }
  if (taken.empty()) return;
  const auto [earliest, latest] = std::ranges::minmax(taken);
  if (latest.first - earliest.first > config_.max_spread_s) {
    warnings.push_back(
        fmt::format("observation {}: {} took its frame {:.1f} s after {}; the forging must have stood still", index,
                    latest.second, latest.first - earliest.first, earliest.second));
  }
}

std::uint32_t ObservationAssembler::expected(const std::string& name) const {
  const Session* session = find(name);
  return session == nullptr ? 0 : session->expected;
}

std::vector<ObservationState> ObservationAssembler::states(const std::string& name) const {
  std::vector<ObservationState> states;
  const Session* session = find(name);
  if (session == nullptr) return states;
  for (const auto& [index, observation] : session->observations) {
    ObservationState state{static_cast<int>(index),  observation.rotation_deg,       observation.settled, {},
                           waiting_for(observation), observation.trigger.has_value()};
    for (const auto& [camera, imprint] : observation.imprints) state.reported.push_back(camera);
    states.push_back(std::move(state));
  }
  return states;
}

std::vector<Trigger> ObservationAssembler::open_triggers(const std::string& camera_id) const {
  std::vector<Trigger> open;
  for (const auto& [name, session] : sessions_) {
    for (const auto& [index, observation] : session.observations) {
      if (!observation.settled && observation.trigger && !observation.imprints.contains(camera_id)) {
        open.push_back(*observation.trigger);
      }
    }
  }
  return open;
}

std::vector<std::string> ObservationAssembler::sessions() const {
  std::vector<std::string> names;
  for (const auto& [name, session] : sessions_) names.push_back(name);
  return names;
}

bool ObservationAssembler::has_room() const {
  const auto open = std::ranges::count_if(sessions_, [](const auto& entry) { return is_open(entry.second); });
  return static_cast<std::size_t>(open) < config_.max_sessions;
}

bool ObservationAssembler::is_open(const Session& session) {
  return session.due ||
         std::ranges::any_of(session.observations, [](const auto& entry) { return !entry.second.settled; });
}

ObservationAssembler::Session& ObservationAssembler::open_session(const std::string& name, Time now) {
  if (!sessions_.contains(name) && sessions_.size() >= config_.max_sessions) {
    const auto leave_first = std::ranges::min_element(
        sessions_, {}, [&](const auto& entry) { return std::pair(is_open(entry.second), entry.second.touched); });
    if (is_open(leave_first->second)) displaced_.push_back(leave_first->first);
    sessions_.erase(leave_first);
  }
  Session& session = sessions_[name];
  session.touched = now;
  return session;
}

ObservationAssembler::Pending& ObservationAssembler::open_observation(Session& session, std::uint32_t index,
                                                                      double rotation_deg, Time now) {
  const auto [entry, is_new] = session.observations.try_emplace(index);
  if (is_new) {
    entry->second.rotation_deg = rotation_deg;
    entry->second.deadline = now + seconds(config_.deadline_s);
  }
  return entry->second;
}

const ObservationAssembler::Session* ObservationAssembler::find(const std::string& session) const {
  const auto found = sessions_.find(session);
  return found == sessions_.end() ? nullptr : &found->second;
}

std::vector<std::string> ObservationAssembler::waiting_for(const Pending& observation) const {
  std::vector<std::string> waiting;
  std::ranges::copy_if(camera_ids_, std::back_inserter(waiting),
                       [&](const std::string& camera) { return !observation.imprints.contains(camera); });
  return waiting;
}

std::string ObservationAssembler::reason_missing(const std::string& camera_id) const {
  return fmt::format("{}no imprint within {} s", alive_.contains(camera_id) ? "connected, but " : "not connected, ",
                     config_.deadline_s);
}

}  // namespace imprint
