#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "fusion/combine/alignment.h"
#include "fusion/combine/rod_surface.h"
#include "fusion/triangulate/triangulate.h"

namespace imprint {

/// One camera of one observation.
struct Viewer {
  std::size_t observation = 0;
  Eigen::Vector3d center_world_mm = Eigen::Vector3d::Zero();
  Matrix6d pose_covariance = Matrix6d::Zero();
  Eigen::Matrix3d R_cam_world = Eigen::Matrix3d::Identity();
};

/// One tangent, ordered along its rim, and what the estimate so far makes of it.
struct TangentRow {
  std::size_t viewer = 0;  ///< index into TangentRows::viewers
  Eigen::Vector3d ray_world = Eigen::Vector3d::UnitZ();
  double variance_mm2 = 1.0;  ///< stated, weight included
  bool continues = false;     ///< the same rim as the row before, one station on
  double x_mm = 0.0;
  double residual_mm = 0.0;
  double from_circle_mm = 0.0;  ///< from the section without its out-of-round
  double trust = 1.0;
  bool used = false;
};

struct TangentRows {
  std::vector<Viewer> viewers;
  std::vector<TangentRow> rows;
};

/// All tangents of all observations that carry weight, rim by rim and along each rim by x. Cameras left out have none.
TangentRows tangent_rows(std::span<const ObservedForging> observations);

/// A tangent as a linear equation: coefficients . node + effects of its camera's and its observation's place = value.
struct TangentEquation {
  std::size_t node = 0;
  double share = 0.0;  ///< of the next node
  double along = 0.0;  ///< share of the length
  NodeVector coefficients = NodeVector::Zero();
  double value_mm = 0.0;
  double x_per_mm = 0.0;              ///< RodSurface::Contact
  double extra_variance_mm2 = 0.0;    ///< of the value, beside the tangent's own
  double camera = 0.0;                ///< effect of the camera's place across the axis
  Vector6d place = Vector6d::Zero();  ///< effect of the observation's place: shift, turn about the middle
};

/// Of `row` against the rod as it is now; moves the row's x to where its ray is nearest to the axis. Nothing where the
/// ray touches nowhere, or within `margin_mm` of an end, where it may belong to the end circle instead.
std::optional<TangentEquation> equation_of(TangentRow& row, const Viewer& viewer, const Placement& placement,
                                           const RodSurface& rod, double length_mm, double margin_mm);

/// Scatter of the tangents along their rims, in their stated sigmas: from second differences wide enough to see what
/// haze and filtering move together. `start` is what they are compared with: an estimate could bend itself to the
/// tangents until none scatter.
double rim_scatter(std::span<const TangentRow> rows, std::span<const std::optional<TangentEquation>> equations,
                   std::span<const NodeVector> start);

/// How many neighbouring tangents of a rim count as one: the sum of their residuals' likeness over all distances, out
/// to where none is left. Counted so, a rim that hot air bends over tens of px says no more than it knows.
/// `noise_scale`: of the stated sigmas.
double moved_together(std::span<const TangentRow> rows, double noise_scale);

}  // namespace imprint
