#pragma once

#include "node/segment/body_search.h"

namespace imprint {

/// What else in the image is as bright as `body`, at least half a diameter squared large and of one piece: other hot
/// bodies, doors, windows. At most five, the largest first.
std::vector<SeenBody> find_other_bodies(const WorkingImage& working, const FoundBody& body, const SegmentPrior& prior,
                                        const SegmentConfig& config);

}  // namespace imprint
