#pragma once

#include <vector>

#include "node/detect/detect_targets.h"
#include "node/detect/detection_trace.h"
#include "node/detect/ellipse.h"

namespace imprint {

/// A target with what decides between two that claim the same id or place.
struct FoundTarget {
  DetectedTarget target;
  Ellipse ellipse;
  double lead = 0.0;     ///< `DecodedRing::lead`
  double fit = 0.0;      ///< `DecodedRing::fit`
  bool covered = false;  ///< in part
};

/// Rings that gave no id.
struct UnreadRings {
  int all = 0;
  int like_codes = 0;  ///< those that covers could have made of a code
};

/// What is left of an image's targets, each id at most once, by ascending id; what is left out goes to `trace`, which
/// may be null.
/// Where many rings are `unread`, that is of no code, some read as one by chance: the fewer targets there are to so
/// many rings, the larger the lead that each must have. Of two targets that claim one id the one with fewer bits amiss
/// stays; when neither is better, both go: a wrong id costs more than a missing one.
std::vector<DetectedTarget> choose_targets(std::vector<FoundTarget> found, const UnreadRings& unread,
                                           DetectionTrace* trace);

}  // namespace imprint
