#include "fusion/results/straightness.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Dense>

namespace imprint {

namespace {

struct Places {
  std::vector<double> u;  // along the axis, -1 to 1
  std::vector<Eigen::Vector2d> axis_mm;
};

using Line = Eigen::Matrix2d;  // rows: level, slope

double distance_mm(const Places& places, std::size_t i, const Line& line) {
  return (places.axis_mm[i] - line.transpose() * Eigen::Vector2d(1.0, places.u[i])).norm();
}

/// The line whose largest distance from `chosen` is least, as the limit of least p-th powers: weighted least squares,
/// Newton's step, p doubled.
Line least_largest(const Places& places, const std::vector<std::size_t>& chosen) {
  Line line = Line::Zero(), best = line;
  double least = std::numeric_limits<double>::infinity();
  std::vector<double> distance(chosen.size(), 1.0);
  double largest = 1.0;
  for (double p = 2.0; p < 3000.0; p *= 2.0) {
    for (int iteration = 0; iteration < (p > 2.0 ? 6 : 1); ++iteration) {
      Eigen::Matrix2d normal = Eigen::Matrix2d::Zero(), right = Eigen::Matrix2d::Zero();
      for (std::size_t i = 0; i < chosen.size(); ++i) {
        const double weight = std::pow(distance[i] / largest, p - 2.0);
        const Eigen::Vector2d row(1.0, places.u[chosen[i]]);
        normal += weight * row * row.transpose();
        right += weight * row * places.axis_mm[chosen[i]].transpose();
      }
      normal.diagonal().array() += 1e-12 * normal.trace();
      line += (normal.ldlt().solve(right) - line) / (p - 1.0);
      for (std::size_t i = 0; i < chosen.size(); ++i) distance[i] = distance_mm(places, chosen[i], line);
      largest = *std::ranges::max_element(distance);
      if (largest < least) least = largest, best = line;
      if (!(largest > 0.0)) return best;
    }
  }
  return best;
}

}  // namespace

double minimum_zone_mm(std::span<const double> s_mm, std::span<const Eigen::Vector2d> axis_mm) {
  const std::size_t n = s_mm.size();
  if (n < 3) return 0.0;
  const double middle = 0.5 * (s_mm.front() + s_mm.back());
  const double half = std::max(0.5 * (s_mm.back() - s_mm.front()), 1e-9);
  Places places{.u = {}, .axis_mm = {axis_mm.begin(), axis_mm.end()}};
  for (const double s : s_mm) places.u.push_back((s - middle) / half);
  // A few places decide: those the line of the others leaves furthest off join until it leaves none further than its
  // own.
  std::vector<std::size_t> chosen{0, n / 2, n - 1};
  double zone = std::numeric_limits<double>::infinity();
  while (chosen.size() <= n) {
    const Line line = least_largest(places, chosen);
    std::size_t worst = 0;
    double furthest = 0.0, of_chosen = 0.0;
    for (std::size_t i = 0; i < n; ++i)
      if (const double distance = distance_mm(places, i, line); distance > furthest) furthest = distance, worst = i;
    for (const std::size_t i : chosen) of_chosen = std::max(of_chosen, distance_mm(places, i, line));
    zone = std::min(zone, 2.0 * furthest);
    if (furthest <= of_chosen * (1.0 + 1e-4)) break;
    chosen.push_back(worst);
  }
  return zone;
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
