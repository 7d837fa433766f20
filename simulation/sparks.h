#pragma once

#include <opencv2/core.hpp>

#include "simulation/scene.h"
#include "simulation/silhouette_outline.h"

namespace imprint {

/// Adds glowing particles that fly off the forging: short bright streaks near the outline and before it.
void add_sparks(const Scene& scene, const BodyOutline& outline, int observation, int camera, cv::Mat& image);

}  // namespace imprint
