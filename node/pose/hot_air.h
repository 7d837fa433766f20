#pragma once

#include <vector>

#include "lib/result/result.h"
#include "node/detect/detect_targets.h"
#include "node/segment/segment.h"

namespace imprint {

struct HotAirConfig {
  double sigma_px = 0.16;        ///< of a target beside the forging, in x and y: [B] 3.4, 0.25 px RMS hot, 0.11 cold
  double reach_diameters = 1.0;  ///< distance over which it falls to 1/e, in diameters of the forging as seen; ours

  [[nodiscard]] Result<void> validate() const;
};

/// The targets with what hot air does to their place added to their sigma: sigma_px exp(-d / (reach D)), where d is the
/// distance in the image from the forging's silhouette and D its median width. Targets in front of hot air cannot be
/// told from those behind it, nor where is up: the weight depends on the distance alone.
std::vector<DetectedTarget> weigh_hot_air(std::vector<DetectedTarget> targets, const Segmentation& forging,
                                          const HotAirConfig& config);

}  // namespace imprint
