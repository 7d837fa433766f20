#include "node/capture/exposure_control.h"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

namespace imprint {
namespace {

constexpr double kSaturatedLevel = 0.999;
constexpr double kSaturatedShare = 0.005;  // what the 99.5 percentile leaves
constexpr double kLowest = 0.5;            // of the target
constexpr double kHighest = 0.6;           // of the way from the target to full scale
constexpr double kTooDark = 0.25;          // of the target: edges drown in noise
constexpr double kSameExposure = 1e-3;     // relative

double amplification(double gain_db) { return std::pow(10.0, gain_db / 20.0); }

// The factor that brings the level to the target. A level that saturates is not known: its share tells how far to go.
double wanted_factor(const ExposureConfig& config, const BodyLight& light) {
  if (is_saturated(light))
    return light.saturated_fraction > 0.5 ? 1.0 / config.max_step : std::max(0.5, 1.0 / config.max_step);
  const double highest = config.target_level + kHighest * (1.0 - config.target_level);
  if (light.level >= kLowest * config.target_level && light.level <= highest) return 1.0;
  return std::clamp(config.target_level / light.level, 1.0 / config.max_step, config.max_step);
}

Exposure within_limits(const ExposureConfig& config, double time_at_no_gain_us) {
  Exposure exposure;
  exposure.time_us = std::clamp(time_at_no_gain_us, config.min_time_us, config.max_time_us);
  exposure.gain_db = std::clamp(20.0 * std::log10(time_at_no_gain_us / exposure.time_us), 0.0, config.max_gain_db);
  return exposure;
}

std::string alarm_of(const ExposureConfig& config, const BodyLight& light, double now_us, double next_us) {
  if (is_saturated(light) && next_us >= now_us * (1.0 - kSameExposure))
    return fmt::format("cannot hold the body out of saturation: exposure at its minimum {:g} us", config.min_time_us);
  if (light.level < kTooDark * config.target_level && next_us <= now_us * (1.0 + kSameExposure))
    return fmt::format("body at {:.0f} % of full scale only: exposure at its maximum {:g} us and {:g} dB",
                       100.0 * light.level, config.max_time_us, config.max_gain_db);
  return {};
}

}  // namespace

Result<void> ExposureConfig::validate() const {
  if (!(min_time_us >= 0.1 && max_time_us >= min_time_us && max_time_us <= 1e7))
    return invalid_input("min_us, max_us: expected 0.1 <= min_us <= max_us <= 1e7, found {} and {}", min_time_us,
                         max_time_us);
  if (!(max_gain_db >= 0 && max_gain_db <= 60))
    return invalid_input("max_gain_db: expected 0 to 60, found {}", max_gain_db);
  if (!(target_level >= 0.1 && target_level <= 0.95))
    return invalid_input("target_level: expected 0.1 to 0.95, found {}", target_level);
  if (!(max_step > 1 && max_step <= 100)) return invalid_input("max_step: expected above 1 to 100, found {}", max_step);
  return {};
}

bool is_saturated(const BodyLight& light) {
  return light.level >= kSaturatedLevel || light.saturated_fraction > kSaturatedShare;
}

ExposureDecision next_exposure(const ExposureConfig& config, const Exposure& current, const BodyLight& light) {
  if (!(light.level > 0.0) || !(current.time_us > 0.0)) return {current, false, {}};
  const double now_us = current.time_us * amplification(current.gain_db);
  const double factor = wanted_factor(config, light);
  if (factor == 1.0) return {current, false, {}};
  ExposureDecision decision{within_limits(config, factor * now_us), false, {}};
  const double next_us = decision.next.time_us * amplification(decision.next.gain_db);
  decision.changed = std::abs(next_us - now_us) > kSameExposure * now_us;
  decision.alarm = alarm_of(config, light, now_us, next_us);
  if (!decision.changed) decision.next = current;
  return decision;
}

}  // namespace imprint
