#pragma once

#include "node/imprint/filter_config.h"
#include "node/imprint/rim_curve.h"

namespace imprint {

/// Takes all weight from the stretches of `rim` (between `cuts`) that are not part of its likeliest course: the chain
/// of stretches of the greatest total length less the price of the steps from each to the next. Scale that hides the
/// rim moves the edge of one rim alone and back again: two such steps cost more than the stretch between them is worth.
/// A real step of the diameter is shared by `other` and costs little.
void keep_likeliest_course(RimCurve& rim, const std::vector<double>& cuts, const RimCurve& other, double noise_px,
                           double diameter_px, const FilterConfig& config);

}  // namespace imprint
