#pragma once

#include "lib/result/result.h"

namespace imprint {

/// How a ring's readings become an id.
enum class Decoder {
  likelihood,  ///< maximum likelihood with error correction
  plain  ///< each bit by a threshold half-way, the code looked up: "state of the art" of [A] section 3, for comparison
};

/// How coded targets are looked for. The defaults suit dots of 2 to 120 px; a narrower range is quicker.
struct DetectConfig {
  double min_dot_px = 2.0;       ///< least mean diameter of a dot's ellipse; 2 a_Tmin of [A] equation 7
  double max_dot_px = 120.0;     ///< largest mean diameter; 2 a_Tmax of [A] equation 7
  double max_axis_ratio = 12.0;  ///< distor_max of [A] equation 7: 12 is a view at 5 degrees to the plate
  double min_contrast = 8.0;     ///< white minus black in grey levels of the image, c_min of [A] equation 10
  double max_residual = 0.12;    ///< rms distance of edge points to the ellipse in dot radii, e_max of [A] equation 9
  double max_unknown = 0.30;     ///< share of the ring that may be neither black nor white
  Decoder decoder = Decoder::likelihood;
  int max_candidates_per_tile = 400;  ///< ours: bounds the time in clutter; a tile is 256 x 256 px of a pyramid level

  [[nodiscard]] Result<void> validate() const;
};

}  // namespace imprint
