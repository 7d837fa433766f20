#pragma once

#include <vector>

#include <Eigen/Core>

namespace imprint {

/// A regular polygon with rounded corners and faces that bulge a little, by its support function:
/// h(phi) = corner radius + softmax of (corner . normal), which is convex whatever its sharpness. Lengths in mm.
struct PolygonSection {
  std::vector<Eigen::Vector2d> corners, corners_dx;  ///< of the corners' arcs; their derivatives along x
  double corner_radius = 0.0;
  double sharpness = 0.0;       ///< 1/mm, of the softmax: ln 2 / bulge
  double first_face_rad = 0.0;  ///< outward normal of the first face

  [[nodiscard]] int faces() const { return static_cast<int>(corners.size()); }

  struct Support {
    double h, h_phi, h_phiphi, h_x, h_xphi;
  };
  [[nodiscard]] Support support(double phi) const;

  /// Where a ray in the section's plane, from `from` along `direction`, comes upon a face, and the outward normal
  /// there, which turns from face to face over the corners' arcs; on the faces' planes, for brightness only.
  struct Hit {
    Eigen::Vector2d at, normal;
  };
  [[nodiscard]] Hit meet(const Eigen::Vector2d& from, const Eigen::Vector2d& direction) const;
};

/// `half_width` from the centre to the middle of each face, and its derivative along x.
PolygonSection polygon_section(int faces, double half_width, double half_width_dx, double corner_radius,
                               double face_bulge, double first_face_rad);

}  // namespace imprint
