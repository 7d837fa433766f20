#pragma once

#include <vector>

#include <Eigen/Core>

#include "tests/unit/fusion/triangulate/forging_views.h"

namespace imprint::test {

/// Two scanners on tripods, one to either side of the forging ([D] 2.2.1): 4 m away, 1.2 m above it. What lies below
/// stays in the dark.
struct LaserScan {
  double spacing_mm = 3.0;       ///< of the points on the forging
  double noise_mm = 2.0;         ///< of the range, along the scanner's line of sight
  double registration_mm = 0.0;  ///< standard deviation per axis of where the second scanner's points lie as a whole
};

/// What they see of the rod where it lies, world.
std::vector<Eigen::Vector3d> scanned(const Rod& rod, const Lying& lying, const LaserScan& scan, unsigned seed);

}  // namespace imprint::test
