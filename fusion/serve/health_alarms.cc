#include "fusion/serve/health_alarms.h"

#include <algorithm>

namespace imprint {

Result<void> HealthLimits::validate() const {
  if (!(hysteresis >= 0.0 && hysteresis < 1.0))
    return invalid_input("hysteresis: expected 0 to below 1, found {}", hysteresis);
  if (records < 1 || records > 100) return invalid_input("records: expected 1 to 100, found {}", records);
  return {};
}

std::vector<HealthAlarms::Watched> HealthAlarms::watched(const Health& health) const {
  // What is read of a frame is known once there was one, and of rims once they were seen.
  const auto of_frame = [&](double value) {
    return health.frames > 0 && value > 0.0 ? std::optional(value) : std::nullopt;
  };
  std::optional<double> hottest = health.housing_temperature_c;
  if (health.sensor_temperature_c)
    hottest = std::max(hottest.value_or(*health.sensor_temperature_c), *health.sensor_temperature_c);
  return {
      {"temperature", "temperature", "C", limits_.max_temperature_c, true, hottest},
      {"reprojection", "reprojection rms of the targets", "px", limits_.max_reprojection_px, true,
       of_frame(health.reprojection_rms_px)},
      {"blur", "blur across the rims", "px", limits_.max_blur_px, true, of_frame(health.blur_px)},
      {"contrast", "contrast across the rims", "of full scale", limits_.min_contrast, false, of_frame(health.contrast)},
      {"storage", "free storage of the node", "MB", limits_.min_storage_mb, false, health.storage_free_mb}};
}

std::vector<HealthAlarms::Change> HealthAlarms::note(const Health& health) {
  std::vector<Change> changes;
  for (const Watched& watch : watched(health)) {
    if (watch.limit <= 0.0 || !watch.value) continue;
    const std::string name = std::string(watch.name) + '_' + health.camera_id;
    State& state = states_[name];
    const double margin = state.stands ? limits_.hysteresis * watch.limit : 0.0;
    const bool beyond = watch.above ? *watch.value > watch.limit - margin : *watch.value < watch.limit + margin;
    state.streak = beyond == state.stands ? 0 : state.streak + 1;
    if (state.streak < limits_.records) continue;
    state = {.stands = beyond, .streak = 0};
    changes.push_back({name, beyond ? fmt::format("camera {}: {} {:.4g} {}, limit {:.4g}", health.camera_id,
                                                  watch.words, *watch.value, watch.unit, watch.limit)
                                    : ""});
  }
  return changes;
}

}  // namespace imprint
