#pragma once

#include <span>
#include <vector>

#include "fusion/combine/section_shape.h"
#include "fusion/triangulate/triangulate.h"

namespace imprint {

struct CombineConfig;  // in combine_config.h

/// One cross-section from all observations, in the forging's own frame (contract section 1).
struct CombinedSection {
  double s_mm = 0.0;
  Eigen::Vector3d axis_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix2d axis_covariance_mm2 = Eigen::Matrix2d::Zero();  ///< of y, z
  double diameter_mm = 0.0;                                       ///< mean over directions
  double diameter_sigma_mm = 0.0;
  double circularity_mm = 0.0;  ///< (largest - smallest width) / 2, [D] 2.1.3
  double circularity_sigma_mm = 0.0;
};

/// What a section with faces says beside its mean width. Angles in degrees.
struct SectionFacets {
  struct Value {
    double value = 0.0, sigma = 0.0;
  };
  std::vector<Value> widths_mm;             ///< across opposite faces, face by face; `convex`: least and largest width
  Value squareness_deg;                     ///< of four faces: angle between the pairs, less 90
  Value twist_deg;                          ///< about x, against the first section
  Value corner_radius_mm;                   ///< the corners' mean
  std::vector<Eigen::Vector2d> corners_mm;  ///< centres of the corners' circles, in the forging's y and z
};

/// The forging as all observations together show it, aligned.
struct CombinedForging {
  Eigen::Matrix3d R_forging_world = Eigen::Matrix3d::Identity();  ///< for the first observation
  Eigen::Vector3d origin_world_mm = Eigen::Vector3d::Zero();
  double length_mm = 0.0;
  double length_sigma_mm = 0.0;
  std::vector<CombinedSection> sections;  ///< 500, ascending s
  ForgingShape shape;                     ///< of the sections; empty where only their means are known
  /// Forgings that the tangents would show as well as this one: together they say how sure anything made of several
  /// sections is. Empty where that is not known.
  std::vector<ForgingShape> draws;
  SectionKind section_kind = SectionKind::round;
  std::vector<SectionFacets> facets;  ///< one a section, where they are not round
  std::vector<std::string> warnings;
};

/// Pre-alignment by the two end sections, best-fit shift with known rotation ([D] eq. 5), mean axis (eq. 6),
/// sections from all tangents together. `rotations_deg`: one an observation, right-handed about the axis.
/// Fails (job_failed) when there is no observation, or none long enough to align.
Result<CombinedForging> combine(std::span<const ObservedForging> observations, std::span<const double> rotations_deg,
                                const ForgingSpec& forging, const CombineConfig& config);

}  // namespace imprint
