#pragma once

#include "node/imprint/filter_config.h"
#include "node/imprint/rim_curve.h"

namespace imprint {

/// Standard deviation of a sample about its neighbours, from second differences, robust; px.
double rim_noise_px(const RimCurve& rim);

/// Takes weight from samples that leave the median of their neighbourhood.
void drop_spikes(RimCurve& rim);

/// Stations between which the rim has neither step nor kink: where the lines through the samples on the left and on the
/// right meet a station with different values or slopes, and in the middle of gaps. Ascending.
std::vector<double> find_cuts(const RimCurve& rim, double noise_px, const FilterConfig& config);

}  // namespace imprint
