#pragma once

#include <opencv2/core.hpp>

namespace imprint {

/// An 8-bit picture of three channels for the eye: the grey levels between the darkest and brightest two in a thousand,
/// lifted in the shadows, so that a dark hall shows what stands in it. Every pixel keeps its place.
cv::Mat brightened(const cv::Mat& image);

}  // namespace imprint
