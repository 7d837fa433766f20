#pragma once

#include <vector>

#include "node/segment/segment_config.h"
#include "node/segment/working_image.h"

namespace imprint {

/// A direction in the observed image along which something like the forging lies.
struct Direction {
  double x = 1.0, y = 0.0;  ///< unit vector
  double rating = 0.0;      ///< of the best body along it, 0 to 1
};

/// The directions within `max_tilt_deg` of the prior's that are worth a closer look, the best first: the filter of
/// [C] 2.3.2 knows one orientation, so it is turned step by step over an image of half the working size.
std::vector<Direction> likely_directions(const ReducedImage& reduced, const SegmentPrior& prior,
                                         const SegmentConfig& config);

}  // namespace imprint
