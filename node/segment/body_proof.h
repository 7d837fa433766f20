#pragma once

#include <vector>

#include "node/segment/body_levels.h"
#include "node/segment/body_path.h"

namespace imprint {

/// What the picture itself says about a body that was followed, whatever led there.
struct BodyProof {
  double both = 0.0;           ///< share of the columns where the body's level ends at both rims
  double sides = 0.0;          ///< the same with every rim for itself, rims under scale counting a part
  double filled = 0.0;         ///< share of the inside that has about the body's level
  double level = 0.0;          ///< median of the body, share of full scale
  double contrast = 0.0;       ///< median of body over ground, share of full scale
  std::vector<float> columns;  ///< how well each column is proven, 0 to 1: its sides and its inside, half each
};

/// Weighs every column of `path`: just inside a rim the level is about the body's, just outside it is not, be it darker
/// or brighter. Scale is darker than the body: a rim under it is one, but less surely. Marks in `path` which columns
/// have both (`RimPair::both`).
BodyProof prove_body(BodyPath& path, const WorkingImage& working, const BodyLevels& levels);

}  // namespace imprint
