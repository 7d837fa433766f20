#pragma once

#include <optional>
#include <span>

#include "fusion/combine/section_prior.h"

namespace imprint {

/// The rod as a chain of sections describes it: its surface, and where viewing rays touch it. Sections stand square
/// to x; between two nodes everything runs straight.
class RodSurface {
 public:
  RodSurface(std::span<const NodeVector> nodes, double step_mm);

  /// Where a ray touches the rod, and the line that touches the section there:
  /// normal . (y, z) = value_mm, the normal out of the rod and of length 1.
  struct Contact {
    double x_mm = 0.0;
    double nearest_x_mm = 0.0;  ///< where the ray is closest to the axis
    std::size_t node = 0;
    double share = 0.0;  ///< of the next node
    Eigen::Vector2d normal;
    double value_mm = 0.0;
    double x_per_mm = 0.0;           ///< how far the contact moves along x when it moves 1 mm across the section
    Eigen::Vector3d point_mm;        ///< on the ray
    Eigen::Vector3d surface_normal;  ///< of the rod there, its y and z those of `normal`
    Eigen::Matrix<double, 2 * kHarmonics, 1> harmonics;  ///< cos 2 theta, sin 2 theta, ... of the normal
  };

  /// Touching means: of all sections the ray passes, the one it is deepest in (for a tangent: depth 0). On a plain
  /// stretch that is where the ray is nearest to the axis, moved along the ray by the section's out-of-round; next to
  /// a thicker part it may be that part's edge. Nothing when the ray runs along the axis or meets it.
  [[nodiscard]] std::optional<Contact> touch(const Eigen::Vector3d& center_mm, const Eigen::Vector3d& ray,
                                             double x_guess_mm) const;

 private:
  struct Place {
    std::size_t node;
    double share;
  };
  [[nodiscard]] Place place(double x_mm) const;
  [[nodiscard]] double support(std::size_t node, const Eigen::Matrix<double, 2 * kHarmonics, 1>& harmonics) const;
  /// Along x from `x_mm` to where a ray at `distance_mm` is deepest in the rod, when it climbs away from the axis by
  /// `steepness` (in the section, per mm of x).
  [[nodiscard]] double deepest(double x_mm, double distance_mm, double steepness,
                               const Eigen::Matrix<double, 2 * kHarmonics, 1>& harmonics) const;

  std::span<const NodeVector> nodes_;
  double step_mm_;
  double largest_radius_mm_ = 0.0;
};

/// cos 2 theta, sin 2 theta, ..., of the direction (cos theta, sin theta) = `normal`.
Eigen::Matrix<double, 2 * kHarmonics, 1> harmonics_of(const Eigen::Vector2d& normal);

}  // namespace imprint
