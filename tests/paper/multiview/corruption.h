#pragma once

#include <random>

#include "tests/unit/fusion/triangulate/forging_sessions.h"

namespace imprint::test {

/// What a forge does to exactly seen rims. The defaults are the forge scene's.
struct Corruption {
  double edge_sigma_px = 0.1;   ///< white, along each rim
  double haze_sigma_px = 0.15;  ///< of hot air, alike over `haze_px`
  double haze_px = 40.0;
  double pose_sigma_mm = 0.3;  ///< of a camera's place, and as much again at the forging by its rotation
};

/// `session` as such cameras would have seen it; poses come with their covariance.
Session corrupted(const Session& session, const Corruption& corruption, std::mt19937& generator);

/// The same with every camera but the first `cameras` left out.
Session of_cameras(const Session& session, std::size_t cameras);

}  // namespace imprint::test
