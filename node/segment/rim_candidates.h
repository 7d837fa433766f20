#pragma once

#include <vector>

#include "node/segment/segment_config.h"
#include "node/segment/working_image.h"

namespace imprint {

/// A point of a possible rim in one column of the working image.
struct RimCandidate {
  float y_px = 0;
  float strength = 0;  ///< 0 to 1: how far the gradient stands above the noise, saturating
};

/// Possible rims by column: upper ones get brighter with growing y, lower ones darker.
struct RimCandidates {
  std::vector<std::vector<RimCandidate>> upper, lower;
  double gradient_noise = 0.0;  ///< share of full scale per px
};

/// The clean gradient map of [C] 2.3.2 (dual thresholds on magnitude and direction, opening along the axis,
/// connection of weak to strong), for each sign of the gradient on its own, thinned to its ridges.
RimCandidates find_rim_candidates(const WorkingImage& working, const SegmentConfig& config);

}  // namespace imprint
