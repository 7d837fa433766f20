#pragma once

#include <opencv2/core.hpp>

#include "simulation/scene.h"

namespace imprint {

/// What the camera sees behind targets and forging, the same in every frame: a cluttered dark hall, or a white wall
/// with uneven light. CV_32F, shares of full scale.
cv::Mat paint_backdrop(const Scene& scene, int camera);

}  // namespace imprint
