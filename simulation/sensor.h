#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "simulation/scene.h"

namespace imprint {

/// The sensor's answer to `light` (CV_32F, shares of full scale at an exposure of 1): vignetting, shot and read noise,
/// saturation and rounding to 8 or 16 bit. Noise depends on the seed and the row only.
cv::Mat expose(const ImagingScene& imaging, std::uint64_t seed, const cv::Mat& light);

}  // namespace imprint
