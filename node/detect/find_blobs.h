#pragma once

#include <vector>

#include <opencv2/core.hpp>

namespace imprint {

/// Places of one pyramid level that are brighter than what surrounds them at the scale of a dot some 3 to 8 px wide:
/// local maxima of the difference of two Gaussians, in px of that level, the strongest `per_tile` of each tile of
/// 256 x 256 px. Unlike connected edges ([A] 2.3.1) a maximum survives noise and blur, and needs no threshold that
/// suits the whole scene.
std::vector<cv::Point> find_blobs(const cv::Mat& level, double min_contrast, int per_tile);

}  // namespace imprint
