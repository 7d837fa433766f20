#pragma once

#include "lib/result/result.h"

namespace imprint {

/// How the tangents of all observations become one forging.
struct CombineConfig {
  int sections = 500;                       ///< cross-sections of the result, [D] 2.1.2
  int iterations = 7;                       ///< of the joint estimate (ours)
  double rotation_tolerance_deg = 0.5;      ///< sigma of the manipulator's rotation, [D] 2.3.1
  double placing_sigma_mm = 20.0;           ///< how freely an observation may be shifted (ours)
  double end_tilt_sigma_deg = 0.5;          ///< of an end face against the ideal axis (ours)
  double out_of_round_share = 0.005;        ///< first guess of the harmonics' sigma at k = 2, of the radius (ours)
  double out_of_round_length_share = 0.05;  ///< first guess of how far they keep their shape, of the length (ours)
  double common_edge_sigma_px = 0.07;       ///< of all rims, outwards together: what edge models leave (ours)
  double interval_widening = 1.2;           ///< of all sigmas: the amounts they rest on are estimates themselves (ours)
  double max_length_difference_mm = 10.0;   ///< between observations, above which a warning is given (ours)

  [[nodiscard]] Result<void> validate() const;
};

}  // namespace imprint
