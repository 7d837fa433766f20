#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "fusion/combine/rod_surface.h"
#include "fusion/combine/viewer_places.h"
#include "fusion/triangulate/triangulate.h"

namespace imprint {

/// One tangent, and what the estimate so far makes of it.
struct TangentRow {
  std::size_t viewer = 0;  ///< index into TangentRows::viewers
  std::size_t rim = 0;     ///< index into TangentRows::rims
  Eigen::Vector3d ray_world = Eigen::Vector3d::UnitZ();
  double variance_mm2 = 1.0;  ///< stated, weight included
  double x_mm = 0.0;
  double residual_mm = 0.0;
  double from_circle_mm = 0.0;  ///< from the section without its out-of-round
  double trust = 1.0;
  bool used = false;
};

struct TangentRows {
  std::vector<Viewer> viewers;
  std::vector<TangentRow> rows;
  std::vector<std::vector<std::size_t>> rims;  ///< rows of each rim, along it
};

/// All tangents of all observations that carry weight, along the forging, so that what belongs to the same sections
/// lies together in memory. Cameras left out have none.
TangentRows tangent_rows(std::span<const ObservedForging> observations);

/// A tangent of a round forging: coefficients . node + effects of the places = value.
struct TangentEquation : PlacedEquation {
  NodeVector coefficients = NodeVector::Zero();
  double x_per_mm = 0.0;            ///< RodSurface::Contact
  double extra_variance_mm2 = 0.0;  ///< of the value, beside the tangent's own
};

/// Of `row` against the rod as it is now; moves the row's x to where its ray is nearest to the axis. Nothing where the
/// ray touches nowhere, or within `margin_mm` of an end, where it may belong to the end circle instead.
std::optional<TangentEquation> equation_of(TangentRow& row, const ViewerPlaces& places, const RodSurface& rod,
                                           double length_mm, double margin_mm);

/// Effects of the places on the tangent that touches at `point_mm` with `surface_normal`, into `equation`.
void set_place_effects(PlacedEquation& equation, const Eigen::Vector3d& center_mm, const Eigen::Vector3d& point_mm,
                       const Eigen::Vector3d& surface_normal, double length_mm);

/// How far from either end a tangent may belong to the end's outline instead: by how well the ends are known, but not
/// the whole forging where they are not.
double end_margin_mm(double step_mm, double end_sigma_mm, double radius_mm);

/// Scatter of the tangents along their rims, in their stated sigmas: from second differences wide enough to see what
/// haze and filtering move together. `off_mm`: of each row from what the estimate starts with, where it has a say; the
/// estimate itself could bend to the tangents until none scatter.
double rim_scatter(const TangentRows& tangents, std::span<const std::optional<double>> off_mm);

/// How many neighbouring tangents of a rim count as one: the sum of their residuals' likeness over all distances, out
/// to where none is left. Counted so, a rim that hot air bends over tens of px says no more than it knows.
/// `noise_scale`: of the stated sigmas.
double moved_together(const TangentRows& tangents, double noise_scale);

}  // namespace imprint
