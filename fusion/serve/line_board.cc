#include "fusion/serve/line_board.h"

#include <fmt/core.h>

#include "lib/clock/wall_clock.h"

namespace imprint {
namespace {

using nlohmann::json;

constexpr auto kNamesakesGone = std::chrono::seconds(120);  // past the longest pause a node makes within a frame (60 s)
constexpr std::size_t kMaxBoots = 16;

double age_s(LineBoard::Time then, LineBoard::Time now) {
  return std::chrono::duration_cast<std::chrono::duration<double>>(now - then).count();
}

// 64 bits do not fit the numbers of every JSON reader.
std::string hex(std::uint64_t value) { return fmt::format("{:016x}", value); }

json known(const std::optional<double>& value) { return value ? json(*value) : json(); }

json health_json(const Health& health, double age) {
  return {{"housing_temperature_c", known(health.housing_temperature_c)},
          {"sensor_temperature_c", known(health.sensor_temperature_c)},
          {"storage_free_mb", known(health.storage_free_mb)},
          {"clock_offset_s", known(health.clock_offset_s)},
          {"time", utc_text(health.time_ns)},
          {"age_s", age},
          {"boot_id", hex(health.boot_id)},
          {"sequence", health.sequence},
          {"frames", health.frames},
          {"failed_frames", health.failed_frames},
          {"targets_seen", health.targets_seen},
          {"reprojection_rms_px", health.reprojection_rms_px},
          {"contrast", health.contrast},
          {"saturated_fraction", health.saturated_fraction},
          {"body_level", health.body_level},
          {"blur_px", health.blur_px},
          {"haze_px", health.haze_px},
          {"exposure_us", health.exposure_us},
          {"gain_db", health.gain_db},
          {"exposure_alarm", health.exposure_alarm},
          {"dropped_frames", health.dropped_frames},
          {"capture_restarts", health.capture_restarts},
          {"capture_fault", health.capture_fault},
          {"pose_state", pose_state_name(health.pose_state)},
          {"last_error", health.last_error},
          {"version", health.version}};
}

json delivery_json(const Delivery& delivery, double age) {
  return {{"age_s", age},
          {"boot_id", hex(delivery.boot_id)},
          {"sequence", delivery.sequence},
          {"waiting", delivery.waiting},
          {"waiting_bytes", delivery.waiting_bytes},
          {"discarded", delivery.discarded},
          {"refused", delivery.refused},
          {"fault", delivery.fault}};
}

json imprint_json(const Imprint& imprint, double age) {
  return {{"session", imprint.session},
          {"observation", imprint.observation},
          {"rotation_deg", imprint.rotation_deg},
          {"sequence", imprint.sequence},
          {"sensor_time", utc_text(imprint.sensor_time_ns)},
          {"age_s", age},
          {"targets_used", imprint.quality.targets_used},
          {"reprojection_rms_px", imprint.quality.reprojection_rms_px},
          {"edge_coverage", imprint.quality.edge_coverage},
          {"contrast", imprint.quality.contrast},
          {"saturated_fraction", imprint.quality.saturated_fraction},
          {"frame_saturated_fraction", imprint.quality.frame_saturated_fraction},
          {"body_level", imprint.quality.body_level},
          {"blur_px", imprint.quality.blur_px},
          {"haze_px", imprint.quality.haze_px},
          {"method", imprint.method},
          {"pose_state", pose_state_name(imprint.pose_state)},
          {"pose_doubtful", imprint.pose_doubtful},
          {"failure", imprint.failure},
          {"warnings", imprint.warnings}};
}

}  // namespace

json to_json(const StoredResult& result) {
  json document = {{"schema", "imprint.session_result/1"},
                   {"session", result.session},
                   {"complete", result.complete},
                   {"error", result.error},
                   {"made_at", utc_text(result.made_ns)},
                   {"revision", result.revision},
                   {"result", nullptr}};
  if (!result.json.empty()) document["result"] = json::parse(result.json, nullptr, false);
  if (document["result"].is_discarded()) document["result"] = nullptr;
  return document;
}

json to_json(const SessionSummary& summary) {
  json document = {{"session", summary.session},   {"complete", summary.complete},
                   {"error", summary.error},       {"made_at", utc_text(summary.made_ns)},
                   {"revision", summary.revision}, {"observations", summary.observations},
                   {"length_mm", nullptr},         {"max_deflection_mm", nullptr}};
  if (summary.length_mm) document["length_mm"] = *summary.length_mm;
  if (summary.max_deflection_mm) document["max_deflection_mm"] = *summary.max_deflection_mm;
  return document;
}

LineBoard::LineBoard(Identity identity, const std::vector<std::string>& camera_ids, Time started, HealthLimits limits)
    : identity_(std::move(identity)), started_(started), camera_ids_(camera_ids), health_alarms_(limits) {
  for (const std::string& id : camera_ids) cameras_[id];
  for (const char* counter : {"imprints", "repeated", "surplus", "reordered", "late", "refused", "malformed", "missed",
                              "dropped", "denied", "results"}) {
    counters_[counter] = 0;
  }
}

void LineBoard::set_alive(const std::string& camera_id, bool alive) {
  const std::lock_guard lock(mutex_);
  if (const auto camera = cameras_.find(camera_id); camera != cameras_.end()) camera->second.alive = alive;
}

std::optional<std::string> LineBoard::set_health(const Health& health, Time now) {
  const std::lock_guard lock(mutex_);
  const auto camera = cameras_.find(health.camera_id);
  if (camera == cameras_.end()) return std::nullopt;
  auto raised = watch_for_namesakes(camera->second, health, now);
  const std::int64_t now_ns = wall_clock_ns();
  alarms_.set(
      "exposure_" + health.camera_id,
      health.exposure_alarm.empty() ? "" : fmt::format("camera {}: {}", health.camera_id, health.exposure_alarm),
      now_ns);
  alarms_.set("capture_" + health.camera_id,
              health.capture_fault.empty() ? "" : fmt::format("camera {}: {}", health.camera_id, health.capture_fault),
              now_ns);
  for (const HealthAlarms::Change& change : health_alarms_.note(health)) alarms_.set(change.name, change.text, now_ns);
  camera->second.health = health;
  camera->second.health_at = now;
  return raised;
}

std::optional<std::string> LineBoard::watch_for_namesakes(Camera& camera, const Health& health, Time now) {
  const auto known = camera.boots.find(health.boot_id);
  const bool after_another = camera.health && camera.health->boot_id != health.boot_id;
  const bool late = known != camera.boots.end() && health.time_ns <= known->second;  // it was sent before the other's
  const bool came_back = after_another && known != camera.boots.end() && !late;
  const bool is_new = came_back && !camera.shared_at;
  const std::string name = "two_nodes_" + health.camera_id;
  std::string alarm;
  if (came_back) {
    camera.shared_at = now;
    alarm = fmt::format(
        "camera {0}: two nodes send under this name (boot ids {1} and {2}); stop one of them or give it its own "
        "node.camera_id",
        health.camera_id, hex(camera.health->boot_id), hex(health.boot_id));
    alarms_.set(name, alarm, wall_clock_ns());
  } else if (camera.shared_at && now - *camera.shared_at >= kNamesakesGone) {
    camera.shared_at.reset();
    alarms_.set(name, "", wall_clock_ns());
  }
  if (known == camera.boots.end() && camera.boots.size() >= kMaxBoots) camera.boots.clear();
  if (!late) camera.boots[health.boot_id] = health.time_ns;
  return is_new ? std::optional(alarm) : std::nullopt;
}

void LineBoard::note_imprint(const Imprint& imprint, Time now) {
  const std::lock_guard lock(mutex_);
  const auto camera = cameras_.find(imprint.camera_id);
  if (camera == cameras_.end()) return;
  camera->second.imprint = imprint;
  camera->second.imprint->upper = camera->second.imprint->lower = camera->second.imprint->axis = {};
  camera->second.imprint_at = now;
}

void LineBoard::set_delivery(const Delivery& delivery, Time now) {
  const std::lock_guard lock(mutex_);
  const auto camera = cameras_.find(delivery.camera_id);
  if (camera == cameras_.end()) return;
  camera->second.delivery = delivery;
  camera->second.delivery_at = now;
}

void LineBoard::set_clock(const std::string& camera_id, ClockOffset offset) {
  const std::lock_guard lock(mutex_);
  if (const auto camera = cameras_.find(camera_id); camera != cameras_.end()) camera->second.clock = offset;
}

void LineBoard::set_missing(const std::string& camera_id, std::uint64_t count, const std::string& numbers) {
  const std::lock_guard lock(mutex_);
  const auto camera = cameras_.find(camera_id);
  if (camera == cameras_.end()) return;
  camera->second.missing = count;
  camera->second.missing_numbers = numbers;
}

void LineBoard::set_session(CurrentSession session) {
  const std::lock_guard lock(mutex_);
  session_ = std::move(session);
}

void LineBoard::set_history(HistoryState history) {
  const std::lock_guard lock(mutex_);
  history_ = history;
}

void LineBoard::set_result(const StoredResult& result) {
  json document = to_json(result);
  if (document["result"].is_object()) document["result"].erase("sections");  // the status stays small
  const std::lock_guard lock(mutex_);
  last_result_ = std::move(document);
}

void LineBoard::count(const std::string& counter, std::uint64_t by) {
  const std::lock_guard lock(mutex_);
  counters_[counter] += by;
}

void LineBoard::set_alarm(const std::string& name, const std::string& text) {
  const std::lock_guard lock(mutex_);
  alarms_.set(name, text, wall_clock_ns());
}

bool LineBoard::acknowledge(const std::string& name, const std::string& who) {
  const std::lock_guard lock(mutex_);
  return alarms_.acknowledge(name, who, wall_clock_ns());
}

bool LineBoard::has_alarm() const {
  const std::lock_guard lock(mutex_);
  return alarms_.any();
}

json LineBoard::status(Time now) const {
  const std::lock_guard lock(mutex_);
  json cameras = json::array();
  for (const std::string& id : camera_ids_) cameras.push_back(camera_json(id, cameras_.at(id), now));
  json session;
  if (session_) {
    session = {{"session", session_->session},
               {"observations_expected", session_->expected},
               {"complete", session_->complete},
               {"observations", json::array()}};
    for (const ObservationState& state : session_->observations) {
      session["observations"].push_back({{"index", state.index},
                                         {"rotation_deg", state.rotation_deg},
                                         {"settled", state.settled},
                                         {"triggered", state.triggered},
                                         {"reported", state.reported},
                                         {"waiting", state.waiting}});
    }
  }
  json history;
  if (history_) {
    history = {{"connected", history_->connected},
               {"waiting_messages", history_->waiting_messages},
               {"waiting_results", history_->waiting_results}};
  }
  return {{"schema", "imprint.status/1"},  {"site", identity_.site},        {"line", identity_.line},
          {"method", identity_.method},    {"version", identity_.version},  {"uptime_s", age_s(started_, now)},
          {"cameras", std::move(cameras)}, {"session", std::move(session)}, {"last_result", last_result_},
          {"counters", counters_},         {"alarms", alarms_.standing()},  {"ended_alarms", alarms_.ended()},
          {"history", std::move(history)}};
}

json LineBoard::camera_json(const std::string& id, const Camera& camera, Time now) {
  json document = {{"id", id}, {"alive", camera.alive}, {"health", nullptr}, {"last_imprint", nullptr}};
  document["delivery"] = {{"missing", camera.missing}, {"missing_numbers", camera.missing_numbers}, {"node", nullptr}};
  document["clock"] = nullptr;
  if (camera.clock) {
    document["clock"] = {{"offset_s", 1e-9 * static_cast<double>(camera.clock->offset_ns)},
                         {"uncertainty_s", 1e-9 * static_cast<double>(camera.clock->uncertainty_ns)}};
  }
  if (camera.delivery) document["delivery"]["node"] = delivery_json(*camera.delivery, age_s(camera.delivery_at, now));
  if (camera.health) document["health"] = health_json(*camera.health, age_s(camera.health_at, now));
  if (camera.imprint) document["last_imprint"] = imprint_json(*camera.imprint, age_s(camera.imprint_at, now));
  return document;
}

}  // namespace imprint
