#pragma once

#include "node/segment/body_path.h"
#include "node/segment/body_proof.h"

namespace imprint {

/// The forging as found in the working image.
struct FoundBody {
  BodyPath seen;   ///< where rims were seen
  BodyPath whole;  ///< as far as its brightness goes, with rough rims where none was seen
  AxisLine axis;
  BodyProof proof;      ///< of `whole`
  double rating = 0.0;  ///< how well it fits what is looked for, 0 to 1
  double score = 0.0;   ///< the probability that it is the forging and its outline right
};

/// The straight line through the middles, robust against columns that took a wrong rim: from `start`, the line that the
/// body was followed along and most of the image's pairs have voted for.
AxisLine fit_axis(const BodyPath& path, const AxisLine& start);

/// The bodies along the lines with the most votes, followed on their full pairs only; by descending rating.
std::vector<FoundBody> glimpse_bodies(const RimPairs& pairs, const WorkingImage& working, const SegmentPrior& prior,
                                      const SegmentConfig& config);

/// The bodies that fit the prior, the best first. Those of `glimpse_bodies` that rate best are followed again about
/// their own axis, where one rim alone will do, and once more with the body's brightness known: beams that pass behind
/// it drop out, and it is followed to where its brightness ends.
std::vector<FoundBody> find_bodies(const RimPairs& pairs, const RimCandidates& rims, const WorkingImage& working,
                                   const SegmentPrior& prior, const SegmentConfig& config);

}  // namespace imprint
