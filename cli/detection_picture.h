#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "node/detect/detect_targets.h"
#include "node/detect/detection_trace.h"

namespace imprint {

/// The image, brightened, with what detection saw: targets in green with their ring and id; what was rejected as an
/// ellipse in the colour of its reason, rings that were read in vain also with the nearest id and the distance to it.
/// Below the image, whose pixels keep their places, a legend with each reason and how often it was met. Small images
/// are enlarged by a whole factor.
cv::Mat draw_detection_picture(const cv::Mat& image, const std::vector<DetectedTarget>& targets,
                               const DetectionTrace& trace);

}  // namespace imprint
