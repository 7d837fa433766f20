#pragma once

#include <vector>

#include <opencv2/core.hpp>

namespace imprint {

enum class BlobSize {
  small,  ///< some 3 to 8 px wide
  tiny    ///< some 2 to 4 px wide
};

/// Places of one pyramid level that are brighter than what surrounds them at the scale of a dot of that size:
/// local maxima of the difference of two Gaussians, in px of that level, the strongest `per_tile` of each tile of
/// 256 x 256 px. Unlike connected edges ([A] 2.3.1) a maximum survives noise and blur, and needs no threshold that
/// suits the whole scene.
std::vector<cv::Point> find_blobs(const cv::Mat& level, double min_contrast, int per_tile,
                                  BlobSize size = BlobSize::small);

}  // namespace imprint
