#pragma once

#include <span>
#include <vector>

namespace imprint {

/// Savitzky-Golay filter of 2nd order with weights ([D] 2.1.2, 2.1.3): a weighted parabola fitted in a window
/// of `window` samples about each sample, its value there. Towards the ends the window becomes one-sided
/// instead of shorter. Where the window carries fewer than three weighted samples the value is kept.
std::vector<double> savitzky_golay(std::span<const double> values, std::span<const double> weights, int window);

}  // namespace imprint
