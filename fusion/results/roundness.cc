#include "fusion/results/roundness.h"

#include <cmath>

#include <Eigen/Dense>

namespace imprint {
namespace {

/// Nearest and furthest point of the profile from a centre.
struct Ring {
  double inner_mm, outer_mm;
  [[nodiscard]] double width_mm() const { return outer_mm - inner_mm; }
};

/// The ring whose squared distances are these.
Ring ring_of(const Eigen::ArrayXd& along_y2, const Eigen::ArrayXd& along_z2) {
  const auto squares = along_y2 + along_z2;
  return {std::sqrt(squares.minCoeff()), std::sqrt(squares.maxCoeff())};
}

struct Points {
  Eigen::ArrayXd y, z;

  explicit Points(std::span<const Eigen::Vector2d> profile_mm)
      : y(static_cast<Eigen::Index>(profile_mm.size())), z(static_cast<Eigen::Index>(profile_mm.size())) {
    for (Eigen::Index i = 0; i < y.size(); ++i) {
      y(i) = profile_mm[static_cast<std::size_t>(i)].x();
      z(i) = profile_mm[static_cast<std::size_t>(i)].y();
    }
  }
  [[nodiscard]] Ring ring_about(const Eigen::Vector2d& center_mm) const {
    return ring_of((y - center_mm.x()).square(), (z - center_mm.y()).square());
  }
};

Eigen::Vector2d least_squares_center(const Points& points) {
  Eigen::Vector2d center(points.y.mean(), points.z.mean());
  for (int iteration = 0; iteration < 3; ++iteration) {
    const Eigen::ArrayXd y = points.y - center.x(), z = points.z - center.y();
    const Eigen::ArrayXd distance = (y.square() + z.square()).sqrt();
    Eigen::MatrixX3d rows(distance.size(), 3);
    rows << y / distance, z / distance, Eigen::ArrayXd::Ones(distance.size());
    center += (rows.transpose() * rows).ldlt().solve(rows.transpose() * distance.matrix()).head<2>();
  }
  return center;
}

/// Least value of a convex function on [-reach, reach], and where.
template <typename Function>
std::pair<double, double> least(const Function& value, double reach) {
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kIterations = 24;  // to 1e-5 of the reach
  double low = -reach, high = reach;
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double at_a = value(a), at_b = value(b);
  for (int i = 0; i < kIterations; ++i) {
    if (at_a < at_b) {
      high = b, b = a, at_b = at_a;
      a = high - kGolden * (high - low), at_a = value(a);
    } else {
      low = a, a = b, at_a = at_b;
      b = low + kGolden * (high - low), at_b = value(b);
    }
  }
  return at_a < at_b ? std::pair(at_a, a) : std::pair(at_b, b);
}

/// The centre about which `cost` of the ring is least, sought no further from `from_mm` than `reach_mm` in y and z.
template <typename Cost>
Eigen::Vector2d best_center(const Points& points, const Eigen::Vector2d& from_mm, double reach_mm, const Cost& cost) {
  const auto over_z = [&](double y) {
    const Eigen::ArrayXd along_y2 = (points.y - from_mm.x() - y).square();
    return least([&](double z) { return cost(ring_of(along_y2, (points.z - from_mm.y() - z).square())); }, reach_mm);
  };
  const double y = least([&](double at) { return over_z(at).first; }, reach_mm).second;
  return from_mm + Eigen::Vector2d(y, over_z(y).second);
}

}  // namespace

Roundness roundness(std::span<const Eigen::Vector2d> profile_mm) {
  const Points points(profile_mm);
  const Eigen::Vector2d center = least_squares_center(points);
  const double width = points.ring_about(center).width_mm();
  const Eigen::Vector2d of_zone =
      best_center(points, center, width + 1e-12, [](const Ring& ring) { return ring.width_mm(); });
  const Eigen::Vector2d around =
      best_center(points, center, width + 1e-12, [](const Ring& ring) { return ring.outer_mm; });
  return {.least_squares_mm = width,
          .minimum_zone_mm = points.ring_about(of_zone).width_mm(),
          .minimum_circumscribed_mm = points.ring_about(around).width_mm()};
}

}  // namespace imprint
