#pragma once

#include "node/imprint/paper_filter.h"

namespace imprint {

/// Our own filter (`best`). Each rim is cut where it steps; stretches between two steps on which one rim alone leaves
/// its line (scale that hides the true rim) and stretches on which the middle of the rims leaves its own smooth course
/// get weight 0; what is left is smoothed by robust local parabolas that never reach across a step, weighted by the
/// edge's sigma, magnitude and direction. The curves have a sample at every whole station from the first to the last
/// edge.
FilteredCurves robust_filter(const Silhouette& silhouette, const FilterConfig& config);

}  // namespace imprint
