#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fusion/combine/alignment.h"
#include "fusion/combine/bordered_system.h"
#include "fusion/combine/combine_config.h"
#include "fusion/combine/section_prior.h"
#include "fusion/triangulate/axis_curve.h"

namespace imprint {

/// The forging as a chain of sections at equal steps from x = 0, estimated from the tangents of all observations
/// at once, with all that is needed to say how sure it is.
struct JointEstimate {
  double step_mm = 1.0;
  std::vector<NodeVector> nodes;
  std::vector<NodeMatrix> covariance;  ///< of each node, everything included
  BorderedSystem system{0, 0};         ///< solved
  std::vector<Placement> placements;   ///< from the world of each observation to the forging
  std::vector<double> shift_sigma_mm;  ///< of each observation along x
  double scatter_share = 1.0;          ///< scatter of the tangents about the model, in units of their stated sigma

  [[nodiscard]] AxisCurve axis() const;
};

/// Joint least squares of n . c(x) + h(x, theta) = offset over all tangents: axis c, support function h (radius and
/// harmonics 2 to 6), each observation's place (shift free, turn within the manipulator's tolerance) and each
/// camera's pose within its covariance. Robust (Student's t), with the prior's amounts learnt on the way.
/// `start`: first axis and radius, `placements` and `length_mm` from the pre-alignment and the ends.
/// `shift_sigma_mm`: how well the ends fix each observation along x. Nothing when the equations cannot be solved.
std::optional<JointEstimate> estimate_jointly(std::span<const ObservedForging> observations,
                                              std::vector<Placement> placements, const AxisCurve& start,
                                              std::span<const double> start_radius_mm, double shift_sigma_mm,
                                              const CombineConfig& config);

}  // namespace imprint
