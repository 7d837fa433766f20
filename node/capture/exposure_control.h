#pragma once

#include <string>

#include "lib/result/result.h"
#include "node/capture/exposure.h"

namespace imprint {

/// How the node holds the forging out of saturation; `[exposure]` of node.toml.
struct ExposureConfig {
  bool automatic = true;       // false: as the camera is set; ours
  double min_time_us = 20.0;   // ours
  double max_time_us = 20000;  // a forging stands still for the frame; ours
  double max_gain_db = 0.0;    // beyond max_time_us; gain costs noise; ours
  double target_level = 0.8;   // of the forging's 99.5 percentile, share of full scale; ours
  double max_step = 4.0;       // largest factor from one frame to the next; ours

  [[nodiscard]] Result<void> validate() const;
};

/// What the frame showed of the forging.
struct BodyLight {
  double level = 0.0;               ///< 99.5 percentile, share of full scale; 0: no forging was found
  double saturated_fraction = 0.0;  ///< of its pixels
};

struct ExposureDecision {
  Exposure next;
  bool changed = false;
  std::string alarm;  ///< why the forging cannot be brought to the target; empty when it can
};

/// Whether so much of the forging saturates that its level is not known.
bool is_saturated(const BodyLight& light);

/// The exposure of the frame after one taken with `current`, of a sensor whose values grow in proportion to it.
/// Nothing changes while the level is near enough to the target (from half of it to 0.6 of the way from it to full
/// scale), so that noise and scale do not set it to and fro. Time goes first, gain only beyond the longest time.
ExposureDecision next_exposure(const ExposureConfig& config, const Exposure& current, const BodyLight& light);

}  // namespace imprint
