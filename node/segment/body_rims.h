#pragma once

#include "node/segment/body_levels.h"
#include "node/segment/body_path.h"

namespace imprint {

/// Both rims over the columns of `levels`, each the line along which the body's level ends: up to it most of a column
/// is about as bright as the body, beyond it darker, or brighter where clutter outshines it. Edges draw it to
/// themselves; what is shorter than about half the width is not followed, so that beams which cross do not bend
/// it. `half_min_px`, `half_max_px`: from the axis.
BodyPath trace_rims(const WorkingImage& working, const AxisLine& line, const BodyLevels& levels,
                    const RimCandidates& rims, double width_px, double half_min_px, double half_max_px);

}  // namespace imprint
