#include "fusion/triangulate/savitzky_golay.h"

#include <algorithm>

#include <Eigen/Dense>

namespace imprint {

std::vector<double> savitzky_golay(std::span<const double> values, std::span<const double> weights, int window) {
  const int n = static_cast<int>(values.size());
  std::vector<double> filtered(values.begin(), values.end());
  const int width = std::min(window, n);
  for (int i = 0; i < n; ++i) {
    const int first = std::clamp(i - width / 2, 0, n - width);
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    int used = 0;
    for (int j = first; j < first + width; ++j) {
      const auto k = static_cast<std::size_t>(j);
      if (!(weights[k] > 0.0)) continue;
      const double t = static_cast<double>(j - i) / width;
      const Eigen::Vector3d row(1.0, t, t * t);
      normal += weights[k] * row * row.transpose();
      right += weights[k] * values[k] * row;
      ++used;
    }
    if (used < 3) continue;
    normal.diagonal().array() += 1e-9 * normal(0, 0);
    filtered[static_cast<std::size_t>(i)] = normal.ldlt().solve(right).x();
  }
  return filtered;
}

}  // namespace imprint
