#include "node/detect/image_pyramid.h"

#include <opencv2/imgproc.hpp>

namespace imprint {

ImagePyramid::ImagePyramid(const cv::Mat& image, int levels) {
  constexpr int smallest_side_px = 12;  // a target does not fit into less
  levels_.emplace_back(image);
  for (int l = 1; l < levels; ++l) {
    const cv::Mat& last = levels_.back().mat();
    if (std::min(last.cols, last.rows) / 2 < smallest_side_px) break;
    cv::Mat half;
    const cv::Rect even(0, 0, last.cols & ~1, last.rows & ~1);  // so that a level is exactly half of the last
    cv::resize(last(even), half, {}, 0.5, 0.5, cv::INTER_AREA);
    levels_.emplace_back(half);
  }
}

}  // namespace imprint
