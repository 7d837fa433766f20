#include "fusion/results/straightness.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Dense>

namespace imprint {

double minimum_zone_mm(std::span<const double> s_mm, std::span<const Eigen::Vector2d> axis_mm) {
  const std::size_t n = s_mm.size();
  if (n < 3) return 0.0;
  const double middle = 0.5 * (s_mm.front() + s_mm.back());
  const double half = std::max(0.5 * (s_mm.back() - s_mm.front()), 1e-9);
  // The least largest distance as the limit of least p-th powers: weighted least squares, Newton's step, p doubled.
  Eigen::Matrix2d line = Eigen::Matrix2d::Zero();  // rows: level, slope
  std::vector<double> distance(n, 1.0);
  double best = 0.0;
  for (double p = 2.0; p < 3000.0; p *= 2.0) {
    for (int iteration = 0; iteration < (p > 2.0 ? 6 : 1); ++iteration) {
      const double largest = *std::ranges::max_element(distance);
      if (!(largest > 0.0)) return 0.0;
      Eigen::Matrix2d normal = Eigen::Matrix2d::Zero(), right = Eigen::Matrix2d::Zero();
      for (std::size_t i = 0; i < n; ++i) {
        const double weight = std::pow(distance[i] / largest, p - 2.0);
        const Eigen::Vector2d row(1.0, (s_mm[i] - middle) / half);
        normal += weight * row * row.transpose();
        right += weight * row * axis_mm[i].transpose();
      }
      normal.diagonal().array() += 1e-12 * normal.trace();
      line += (normal.ldlt().solve(right) - line) / (p - 1.0);
      double widest = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        const Eigen::Vector2d row(1.0, (s_mm[i] - middle) / half);
        distance[i] = (axis_mm[i] - line.transpose() * row).norm();
        widest = std::max(widest, distance[i]);
      }
      best = best > 0.0 ? std::min(best, widest) : widest;
    }
  }
  return 2.0 * best;
}

double bow_over_mm(std::span<const double> s_mm, std::span<const Eigen::Vector2d> axis_mm, double stretch_mm) {
  constexpr std::size_t kApart = 2;  // sections between places looked at: a bow is long
  double largest = 0.0;
  std::size_t last = 0;
  for (std::size_t first = 0; first < s_mm.size(); first += kApart) {
    while (last + 1 < s_mm.size() && s_mm[last] - s_mm[first] < stretch_mm) ++last;
    const double length = s_mm[last] - s_mm[first];
    if (!(length > 0.0)) break;
    for (std::size_t i = first; i <= last; i += kApart) {
      const double u = (s_mm[i] - s_mm[first]) / length;
      largest = std::max(largest, (axis_mm[i] - (1.0 - u) * axis_mm[first] - u * axis_mm[last]).norm());
    }
    if (last + 1 == s_mm.size()) break;
  }
  return largest;
}

}  // namespace imprint
