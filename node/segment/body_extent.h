#pragma once

#include "node/segment/body_levels.h"

namespace imprint {

/// The columns of the working image over which a body goes on.
struct BodyExtent {
  int first_x_px = 0;
  int last_x_px = -1;
};

/// As far as the body's brightness goes (`levels`) or, where scale hides that, as its rims and the odds of all its
/// pixels' levels tell. A clean body ends where the level steps across it: a jaw may be nearly as bright, and in line.
BodyExtent extent_of_body(const WorkingImage& working, const AxisLine& line, const BodyLevels& levels,
                          const RimCandidates& rims, double width_px, double half_min_px, double half_max_px);

}  // namespace imprint
