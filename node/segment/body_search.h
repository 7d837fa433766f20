#pragma once

#include "node/segment/body_path.h"

namespace imprint {

/// The forging as found in the working image.
struct FoundBody {
  BodyPath seen;   ///< where rims were seen
  BodyPath whole;  ///< as far as its brightness goes, with rough rims where none was seen
  AxisLine axis;
};

/// The straight line through the middles, robust against columns that took a wrong rim: from `start`, the line that the
/// body was followed along and most of the image's pairs have voted for.
AxisLine fit_axis(const BodyPath& path, const AxisLine& start);

/// The body that fits the prior best; empty when there is none. The lines with the most votes are followed on their
/// full pairs; the best of these again about their own axis, where one rim alone will do, and once more with the body's
/// brightness known: beams that pass behind it drop out, and it is followed to where its brightness ends.
FoundBody find_body(const RimPairs& pairs, const RimCandidates& rims, const WorkingImage& working,
                    const SegmentPrior& prior, const SegmentConfig& config);

}  // namespace imprint
