#include "fusion/thesis/savitzky_golay.h"

#include <algorithm>

#include <Eigen/Dense>

namespace imprint {

std::vector<Eigen::Vector3d> savitzky_golay(const std::vector<Eigen::Vector3d>& points, int window) {
  const auto n = static_cast<Eigen::Index>(points.size());
  const auto width = std::min<Eigen::Index>(n, window);
  if (width < 3) return points;
  Eigen::MatrixXd powers(width, 3);  // of the place within the window, from -1 to 1
  Eigen::MatrixXd values(width, 3);
  for (Eigen::Index j = 0; j < width; ++j) {
    const double t = 2.0 * static_cast<double>(j) / static_cast<double>(width - 1) - 1.0;
    powers.row(j) << 1.0, t, t * t;
  }
  const Eigen::MatrixXd fit = (powers.transpose() * powers).inverse() * powers.transpose();
  std::vector<Eigen::Vector3d> smooth(points.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index first = std::clamp<Eigen::Index>(i - width / 2, 0, n - width);
    for (Eigen::Index j = 0; j < width; ++j) values.row(j) = points[static_cast<std::size_t>(first + j)].transpose();
    smooth[static_cast<std::size_t>(i)] = (powers.row(i - first) * (fit * values)).transpose();
  }
  return smooth;
}

}  // namespace imprint
