#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "fusion/combine/alignment.h"
#include "fusion/combine/combine.h"
#include "fusion/combine/combine_config.h"
#include "fusion/triangulate/axis_curve.h"
#include "fusion/triangulate/end_planes.h"

namespace imprint {

/// Where a ray to the outermost point of an end's outline meets that outline, for an end at about `x_mm`.
using EndOutline = std::function<std::optional<Eigen::Vector3d>(const AxisCurve& axis, const Eigen::Vector3d& eye_mm,
                                                                const Eigen::Vector3d& ray, bool last, double x_mm)>;

/// The ends of a round forging: circles of the median radius over half of each end section.
EndOutline round_ends(const AxisCurve& axis, std::span<const double> radius_mm, double end_section_mm);

/// What a joint estimate starts from: the observations laid on each other by rotation and ends, the first one's axis
/// and radius at equal steps over the length.
struct JointStart {
  std::vector<Placement> placements;
  AxisCurve axis;
  std::vector<double> radius_mm;
  double shift_sigma_mm = 0.0;  ///< how well the ends fix each observation along x
};

/// Fails (job_failed) when there is no observation, or none long enough to align.
Result<JointStart> start_of(std::span<const ObservedForging> observations, std::span<const double> rotations_deg,
                            const ForgingSpec& forging, const CombineConfig& config);

/// Both ends on the estimated forging. `shift_sigma_mm`: of each observation along x. Fails (job_failed) when they
/// enclose nothing.
Result<EndPlanes> final_ends(std::span<const ObservedForging> observations, std::span<const Placement> placements,
                             const AxisCurve& axis, const EndOutline& outline, std::span<const double> shift_sigma_mm,
                             const CombineConfig& config);

/// How large a pixel is at the forging, across the line of sight: median over all tangents.
double mm_per_px(std::span<const ObservedForging> observations);

/// Warns of sections outside the rig's diameters; fails (job_failed) when they are the greater part, or when the
/// forging came out far longer than any observation saw it.
Result<void> within_rig(std::span<const ObservedForging> observations, const ForgingSpec& forging,
                        CombinedForging& combined);

/// Warns of observations whose own length differs from that of all together.
void warn_of_lengths(std::span<const ObservedForging> observations, const CombineConfig& config,
                     CombinedForging& combined);

}  // namespace imprint
