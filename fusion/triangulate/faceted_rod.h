#pragma once

#include <span>

#include "fusion/triangulate/rod_consensus.h"

namespace imprint {

/// `agree_on_rod` for forgings whose sections have faces: every camera sees a width of its own, but the middle of its
/// rims lies beside the axis all the same, exactly so where opposite faces are alike. The radius is the mean of all
/// half widths.
RodConsensus faceted_rod(std::span<const CameraView> views, AxisCurve start);

}  // namespace imprint
