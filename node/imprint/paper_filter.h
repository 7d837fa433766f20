#pragma once

#include "node/imprint/filter_config.h"
#include "node/imprint/rim_curve.h"

namespace imprint {

struct FilteredCurves {
  RimCurve upper, lower, axis;
};

/// The edge points that belong to connected regions of some length and strength, [C] 2.3.2 "Edge validation".
std::vector<EdgePoint> validate_regions(const std::vector<EdgePoint>& points, const FilterConfig& config);

/// The weights of [C] equation 1: a Gaussian that is 1 at the ideal value and 0.5 at the population's mean.
/// `orientation` looks at the direction, `magnitude` at the magnitude, `combined` takes the mean of both, others
/// give 1.
std::vector<double> edge_weights(const std::vector<EdgePoint>& points, EdgeMethod method);

/// The six methods of [C]: weights, then weighted parabolas (`pixel`: Savitzky-Golay for the axis, moving average for
/// the rims; `none`: nothing).
FilteredCurves paper_filter(const Silhouette& silhouette, EdgeMethod method, const FilterConfig& config);

}  // namespace imprint
