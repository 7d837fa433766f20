#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fusion/combine/joint_start.h"
#include "fusion/faceted/corner_model.h"

namespace imprint {

/// A forging with faces as a chain of sections at equal steps from x = 0. The unknowns of a node: y and z of each
/// corner's centre, then the corners' radius.
struct FacetedEstimate {
  double step_mm = 1.0;
  std::vector<CornerModel> nodes;
  std::vector<Eigen::MatrixXd> covariance;  ///< of each node, everything included
  std::vector<Placement> placements;
  std::vector<double> shift_sigma_mm;
  /// Covariance of every node's unknowns with sums over all of them (unknowns of all nodes by columns).
  std::function<Eigen::MatrixXd(const Eigen::MatrixXd& sums)> covariance_with;

  [[nodiscard]] AxisCurve axis() const;  ///< through the middles of the corners
};

/// Joint least squares of n . corner(x) + radius(x) = offset over all tangents, each on the corner it touches, with the
/// observations' and the cameras' places. The corners go with the first axis but for steps; what no tangent tells of a
/// section keeps to its family (affine images of a regular polygon, of `square` and `octagon` similar ones).
/// `sections_mm`: the start, one a node of the axis. Nothing when the equations cannot be solved.
std::optional<FacetedEstimate> estimate_faceted(std::span<const ObservedForging> observations, const JointStart& start,
                                                std::span<const CornerModel> sections_mm, SectionKind kind,
                                                const CombineConfig& config);

}  // namespace imprint
