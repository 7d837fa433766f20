#pragma once

#include <vector>

#include "node/segment/body_levels.h"

namespace imprint {

/// Where the level steps in a straight line across the body: its end, or the face of a jaw that holds it.
struct BodyJoint {
  int x_px = 0;
  bool to_dark = false;  ///< one side is as dark as the ground: on a scaled body it may be scale
};

/// The joints along `line`, by ascending x, of a sixth of the body's contrast or more.
std::vector<BodyJoint> find_joints(const WorkingImage& working, const AxisLine& line, const BodyLevels& levels,
                                   double width_px);

}  // namespace imprint
