#pragma once

#include <vector>

#include <Eigen/Core>

namespace imprint {

/// `points` at equal steps, each replaced by the parabola fitted to the `window` points about it (Savitzky-Golay of
/// second order, [D] 2.1.3). Near an end the nearest whole window is fitted; fewer points than three stay as they are.
std::vector<Eigen::Vector3d> savitzky_golay(const std::vector<Eigen::Vector3d>& points, int window);

}  // namespace imprint
