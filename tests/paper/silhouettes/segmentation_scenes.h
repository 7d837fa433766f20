#pragma once

#include <string>
#include <vector>

#include "simulation/scene.h"

namespace imprint::paper {

/// A scene of one camera and one observation, and what it was given: "dark", "clutter", "jaw", "v-blocks", "others",
/// "second", "cut off", "tilted" (more than 10 deg), "low contrast" (25 to 40 grey levels); "plain" when nothing of it.
struct SegmentationScene {
  Scene scene;
  std::vector<std::string> kinds;
  double tilt_deg = 0.0;         ///< of the body in the image against the rig's direction
  double contrast_levels = 0.0;  ///< of the clean surface, grey levels of 255
};

/// The scene of a number: the same whatever is rendered before. Half of them have clutter that stands out more than the
/// forging. Of an empty hall everything is drawn likewise but the forging.
SegmentationScene segmentation_scene(std::uint64_t seed, int index, bool empty);

}  // namespace imprint::paper
