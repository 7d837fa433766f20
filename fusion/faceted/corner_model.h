#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "fusion/combine/combine.h"

namespace imprint {

/// A convex section with straight faces and rounded corners: the hull of circles of one radius about its corners'
/// centres, which stand counter-clockwise in (y, z). Its support function is linear in all of them:
/// h(n) = largest of corner . n, + radius.
struct CornerModel {
  Eigen::Matrix2Xd corners_mm;
  double radius_mm = 0.0;

  [[nodiscard]] int size() const { return static_cast<int>(corners_mm.cols()); }
  /// The corner that a line with this outward normal touches.
  [[nodiscard]] int touched(const Eigen::Vector2d& normal) const;
  [[nodiscard]] double support(const Eigen::Vector2d& normal) const;
  [[nodiscard]] Eigen::Vector2d center() const { return corners_mm.rowwise().mean(); }
  /// Which way it is turned: that of the regular polygon with its first corner at y which it is most like, in rad.
  [[nodiscard]] double direction() const;
};

/// All that is said of one section, in this order: mean width, circularity ([D] 2.1.3), corner radius, direction (rad),
/// squareness (rad; 0 but for four corners), then the widths: across opposite faces, or the least and the largest for
/// `SectionKind::convex`.
Eigen::VectorXd measures_of(const CornerModel& section, SectionKind kind);
inline constexpr int kMeanWidth = 0, kCircularity = 1, kCornerRadius = 2, kDirection = 3, kSquareness = 4, kWidths = 5;

/// One tangent of a section of size 1: its outward normal and its distance from the axis.
struct SupportSample {
  Eigen::Vector2d normal;
  double distance;
};

/// The section with so many corners that lies best in the samples, and the robust scatter about it. From several
/// starts, as it is turned in an unknown way. `regular`: it is known to be nearly a regular polygon, which even the
/// tangents of one observation tell.
struct CornerFit {
  CornerModel section;
  double scatter = 0.0;
};
CornerFit fit_corners(std::span<const SupportSample> samples, int corners, bool regular = false);

/// The same by harmonics 2 to 6: what a round forging could be. Scatter only.
double harmonic_scatter(std::span<const SupportSample> samples);

/// Projects corners (y, z, y, z, ...) on what no affine image of a regular polygon can be, and on what only its
/// similar images cannot: by these a section departs from its family.
struct FamilyProjections {
  Eigen::MatrixXd not_affine, affine_not_similar;
};
FamilyProjections family_projections(int corners);

}  // namespace imprint
