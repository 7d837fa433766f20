#pragma once

#include <span>

#include "fusion/combine/combine.h"
#include "fusion/thesis/space_curves.h"

namespace imprint {

/// The thesis's forging from one or more observations, [D] 2.1.3: pre-alignment of each, best-fit shift with the known
/// rotation (equation 5), joint axis (equation 6), alignment by the end sections; diameters from the corrected radii
/// ([C] equation 4) about the joint axis, circularity from the widths the cameras saw. [D] gives no interval for one
/// measurement: here the sigmas are those of the means over the section's own radii, from their scatter.
/// `rotations_deg`: one an observation, right-handed about the axis. Fails (job_failed) when there is no observation.
Result<CombinedForging> thesis_geometry(std::span<const SpaceCurves> observations,
                                        std::span<const double> rotations_deg, const ForgingSpec& forging,
                                        const ThesisConfig& config);

}  // namespace imprint
