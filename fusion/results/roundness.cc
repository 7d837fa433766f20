#include "fusion/results/roundness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/Dense>

namespace imprint {
namespace {

/// Nearest and furthest point of the profile from a centre.
struct Ring {
  double inner_mm, outer_mm;
  [[nodiscard]] double width_mm() const { return outer_mm - inner_mm; }
};

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
    const Eigen::ArrayXd squares = (y - center_mm.x()).square() + (z - center_mm.y()).square();
    return {std::sqrt(squares.minCoeff()), std::sqrt(squares.maxCoeff())};
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

/// The x that makes `goal` x least with `rows` x >= `bounds`: the dual simplex method, from the rows named by `basis`,
/// whose multipliers for `goal` must not be negative.
Eigen::Vector4d linear_program(const Eigen::Vector4d& goal, const Eigen::MatrixX4d& rows, const Eigen::VectorXd& bounds,
                               std::array<Eigen::Index, 4> basis) {
  constexpr int kMostSteps = 100;
  Eigen::Vector4d x;
  for (int step = 0; step < kMostSteps; ++step) {
    const Eigen::Matrix4d inverse = Eigen::Matrix4d(rows(basis, Eigen::all)).inverse();
    x = inverse * bounds(basis);
    Eigen::Index enters = 0;
    if ((rows * x - bounds).minCoeff(&enters) >= -1e-9) break;
    const Eigen::RowVector4d multipliers = goal.transpose() * inverse, change = rows.row(enters) * inverse;
    int leaves = -1;
    double lowest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 4; ++i)
      if (change(i) > 1e-12 && multipliers(i) / change(i) < lowest) lowest = multipliers(i) / change(i), leaves = i;
    if (leaves < 0) break;
    basis[static_cast<std::size_t>(leaves)] = enters;
  }
  return x;
}

/// Centre of the narrowest ring. Distances change linearly with a small step of the centre, which makes it a linear
/// program in the step and both radii; a few steps make it exact.
Eigen::Vector2d narrowest_center(const Points& points, Eigen::Vector2d center) {
  constexpr int kSteps = 4;
  const Eigen::Index n = points.y.size();
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::ArrayXd y = points.y - center.x(), z = points.z - center.y(),
                         distance = (y.square() + z.square()).sqrt();
    Eigen::MatrixX4d rows(2 * n, 4);
    rows << y / distance, z / distance, Eigen::ArrayXd::Ones(n), Eigen::ArrayXd::Zero(n),  //
        -y / distance, -z / distance, Eigen::ArrayXd::Zero(n), -Eigen::ArrayXd::Ones(n);
    Eigen::VectorXd bounds(2 * n);
    bounds << distance, -distance;
    // Points that decide lie outside and inside by turns around the profile.
    center += linear_program({0.0, 0.0, 1.0, -1.0}, rows, bounds, {0, n + n / 4, n / 2, n + 3 * n / 4}).head<2>();
  }
  return center;
}

struct Circle {
  Eigen::Vector2d center;
  double radius = 0.0;
  [[nodiscard]] bool holds(const Eigen::Vector2d& point) const {
    return (point - center).norm() <= radius * (1.0 + 1e-12);
  }
};

Circle circle_on(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return {0.5 * (a + b), 0.5 * (a - b).norm()}; }

Circle circle_through(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  Eigen::Matrix2d sides;
  sides << (b - a).transpose(), (c - a).transpose();
  const Eigen::Vector2d from_a = sides.inverse() * (0.5 * sides.rowwise().squaredNorm());
  return {a + from_a, from_a.norm()};
}

/// Centre of the smallest circle around all points (E. Welzl, Smallest enclosing disks, 1991, without its recursion).
Eigen::Vector2d smallest_circle_center(std::span<const Eigen::Vector2d> profile) {
  std::vector<Eigen::Vector2d> points(profile.begin(), profile.end());
  std::ranges::shuffle(points, std::minstd_rand(1));  // neighbours in turn would make it slow
  Circle circle = circle_on(points[0], points[1]);
  for (std::size_t i = 2; i < points.size(); ++i) {
    if (circle.holds(points[i])) continue;
    circle = circle_on(points[i], points[0]);
    for (std::size_t j = 1; j < i; ++j) {
      if (circle.holds(points[j])) continue;
      circle = circle_on(points[i], points[j]);
      for (std::size_t k = 0; k < j; ++k)
        if (!circle.holds(points[k])) circle = circle_through(points[i], points[j], points[k]);
    }
  }
  return circle.center;
}

}  // namespace

Roundness roundness(std::span<const Eigen::Vector2d> profile_mm) {
  const Points points(profile_mm);
  const Eigen::Vector2d center = least_squares_center(points);
  return {.least_squares_mm = points.ring_about(center).width_mm(),
          .minimum_zone_mm = points.ring_about(narrowest_center(points, center)).width_mm(),
          .minimum_circumscribed_mm = points.ring_about(smallest_circle_center(profile_mm)).width_mm()};
}

}  // namespace imprint
