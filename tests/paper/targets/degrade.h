#pragma once

#include <cstdint>

#include "tests/paper/targets/target_sheet.h"

namespace imprint::paper {

/// A sheet scaled by `x` and `y` (at most 1) with a bicubic kernel as wide as the larger pixels, [A] 2.4.
Sheet scaled(const Sheet& sheet, double x, double y);

Sheet blurred(const Sheet& sheet, double sigma_px);

/// Normal noise of mean 0, sigma in units of white.
Sheet with_noise(const Sheet& sheet, double sigma, std::uint64_t seed);

/// 8 bit, clipped.
cv::Mat to_8_bit(const Sheet& sheet);

}  // namespace imprint::paper
