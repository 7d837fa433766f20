#pragma once

#include "fusion/combine/combine.h"
#include "fusion/combine/joint_estimate.h"
#include "fusion/triangulate/end_planes.h"

namespace imprint {

/// The estimate in the aligned frame, into `combined`: sections at equal steps over the length, with their uncertainty
/// and draws of the whole.
void align(const JointEstimate& joint, const EndPlanes& ends, double end_section_mm, int sections,
           CombinedForging& combined);

/// The draws `factor` times as far from the shape, and all rims of each moved outwards alike by
/// `common_radius_sigma_mm`.
void widen_draws(CombinedForging& combined, double factor, double common_radius_sigma_mm);

}  // namespace imprint
