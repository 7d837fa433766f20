#pragma once

#include "node/imprint/filter_config.h"
#include "node/imprint/rim_curve.h"

namespace imprint {

/// Takes the trust from stretches of both rims that cannot be those of one body: where their middle leaves its smooth
/// course, one of them is wrong. Scale moves an edge inwards, so the one that lies further in is not believed; far off
/// it may as well be the other, taken for the edge of something behind the forging, and neither is. What the middle
/// says holds for the neighbours on the same stretch of rim at which the other rim was not seen.
void reject_disagreement(RimCurve& upper, RimCurve& lower, const FilterConfig& config);

}  // namespace imprint
