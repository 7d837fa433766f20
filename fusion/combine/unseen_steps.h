#pragma once

#include <span>
#include <vector>

#include "fusion/triangulate/triangulate.h"

namespace imprint {

/// From each node to the next, `step_mm` apart along the forging: how far the start's radius steps over a stretch where
/// no tangent shows the step, in mm. At an end a shoulder may hide in such a stretch of which the start knows nothing.
/// One less than there are radii.
std::vector<double> unseen_steps(std::span<const ObservedForging> observations, std::span<const double> radius_mm,
                                 double step_mm);

}  // namespace imprint
