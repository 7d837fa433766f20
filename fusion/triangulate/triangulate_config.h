#pragma once

#include "lib/result/result.h"

namespace imprint {

/// How one observation is turned into an axis and tangents.
struct TriangulateConfig {
  int sections = 500;          ///< cross-sections of one observation, [D] 2.1.3
  double edge_sigma_px = 0.1;  ///< of one rim point before the scatter is known (ours)
  double min_view_angle_deg =
      15.0;                     ///< widest angle between two cameras, seen from the axis, below which we refuse (ours)
  double min_rim_share = 0.05;  ///< share of a camera's rim points that must be usable (ours)
  double warn_blind_share = 0.3;         ///< of a view without rims in one piece, above which the result says so (ours)
  double max_ray_distance_share = 0.25;  ///< of the largest diameter: limit of [D] equation 2 on the distance of rays
  double max_disagreement_share = 0.04;  ///< of the diameter: a camera this far from the others contradicts them (ours)

  /// How far a section's rims may lie from a circle, of the radius, and still be the forging's: out-of-round (ours).
  double out_of_round_share = kRoundShare;

  static constexpr double kRoundShare = 0.02;
  static constexpr double kFacetedShare = 0.25;  ///< a square's corners stand out by two fifths of its half width

  [[nodiscard]] bool faceted() const { return out_of_round_share > kRoundShare; }
  [[nodiscard]] Result<void> validate() const;
};

}  // namespace imprint
