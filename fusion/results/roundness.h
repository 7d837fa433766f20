#pragma once

#include <span>

#include <Eigen/Core>

namespace imprint {

/// How far a section is from round, as the width of the ring between two circles about one centre (ISO 12181-1).
struct Roundness {
  double least_squares_mm = 0.0;          ///< about the centre of the least-squares circle
  double minimum_zone_mm = 0.0;           ///< the narrowest ring there is
  double minimum_circumscribed_mm = 0.0;  ///< about the centre of the smallest circle around the section
};

/// Of a closed profile, evenly spread about its middle and near to a circle. At least 8 points.
Roundness roundness(std::span<const Eigen::Vector2d> profile_mm);

}  // namespace imprint
