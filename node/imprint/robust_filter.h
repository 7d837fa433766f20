#pragma once

#include "node/imprint/paper_filter.h"

namespace imprint {

/// Our own filter (`best`). Each edge point is rated by its sigma, its magnitude and how restless the gradient's
/// direction is about it (the border of scale is ragged); where the middle of the rims leaves its own smooth course the
/// rim further in gets weight 0; what is left is smoothed by robust local parabolas that never reach across a step,
/// weighted by the edge's sigma, magnitude and direction. The curves have a sample at every whole station from the
/// first to the last edge.
FilteredCurves robust_filter(const Silhouette& silhouette, const FilterConfig& config);

}  // namespace imprint
