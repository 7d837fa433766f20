#pragma once

#include <opencv2/core.hpp>

#include "node/node_pipeline.h"

namespace imprint {

/// The image, brightened, with what was made of the forging's silhouette: the rims from red (weight just above 0) to
/// green (weight 1); where they are not trusted, dotted in grey, with the edges that were found there and rejected in
/// magenta; the axis in blue, the visible ends as crosses with a bar of two standard deviations either way. Below the
/// image, whose pixels keep their places, a legend with how often each was met.
cv::Mat draw_silhouette_picture(const cv::Mat& image, const ProcessedFrame& frame);

}  // namespace imprint
