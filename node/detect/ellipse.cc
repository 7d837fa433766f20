#include "node/detect/ellipse.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace imprint {
namespace {

/// Closed form for 2 x 2: square root of a symmetric positive definite matrix.
Eigen::Matrix2d square_root(const Eigen::Matrix2d& m) {
  const double root_of_determinant = std::sqrt(m.determinant());
  const double divisor = std::sqrt(m.trace() + 2.0 * root_of_determinant);
  return (m + root_of_determinant * Eigen::Matrix2d::Identity()) / divisor;
}

}  // namespace

EllipseAxes axes_of(const Ellipse& ellipse) {
  const double half_trace = 0.5 * ellipse.shape.trace();
  const double spread = std::sqrt(std::max(0.0, half_trace * half_trace - ellipse.shape.determinant()));
  return {1.0 / std::sqrt(std::max(half_trace - spread, 1e-12)), 1.0 / std::sqrt(half_trace + spread)};
}

double mean_diameter(const Ellipse& ellipse) {
  const EllipseAxes axes = axes_of(ellipse);
  return axes.semi_major_px + axes.semi_minor_px;
}

Eigen::Matrix2d frame_of(const Ellipse& ellipse) { return square_root(ellipse.shape.inverse()); }

std::optional<Ellipse> fit_ellipse(std::span<const Eigen::Vector2d> points, std::span<const double> weights,
                                   const Ellipse& guess) {
  // a x^2 + b x y + c y^2 + d x + e y = 1: well determined since the points surround the origin.
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> right = Eigen::Matrix<double, 5, 1>::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double x = points[i].x();
    const double y = points[i].y();
    Eigen::Matrix<double, 5, 1> row;
    row << x * x, x * y, y * y, x, y;
    normal += weights[i] * row * row.transpose();
    right += weights[i] * row;
  }
  const Eigen::Matrix<double, 5, 1> k = normal.ldlt().solve(right);
  Eigen::Matrix2d quadratic;
  quadratic << k[0], 0.5 * k[1], 0.5 * k[1], k[2];
  const double determinant = quadratic.determinant();
  if (!k.allFinite() || quadratic.trace() <= 0.0 || determinant <= 1e-9) return std::nullopt;
  const Eigen::Vector2d center = -0.5 * quadratic.inverse() * Eigen::Vector2d(k[3], k[4]);
  const double level = 1.0 + center.dot(quadratic * center);
  if (!(level > 0.0)) return std::nullopt;
  const Eigen::Matrix2d frame = frame_of(guess);
  const Eigen::Matrix2d inverse = frame.inverse();
  Ellipse result;
  result.center = guess.center + frame * center;
  result.shape = inverse.transpose() * (quadratic / level) * inverse;
  return result;
}

}  // namespace imprint
