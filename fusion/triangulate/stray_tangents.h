#pragma once

#include <vector>

#include "fusion/triangulate/triangulate.h"

namespace imprint {

/// Takes out the tangents whose distance from the axis is not between those of the sections before and those after:
/// rims that followed a beam or the border of scale. `tolerance_share` is of `radius_mm`; what a forging is out of
/// round has to fit into it. Gives how many were taken out.
int remove_stray_tangents(std::vector<ObservedSection>& sections, double radius_mm, double tolerance_share);

}  // namespace imprint
