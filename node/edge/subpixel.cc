#include "node/edge/subpixel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace imprint {
namespace {

double normal_density(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi); }
double normal_distribution(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

}  // namespace

std::optional<StepFit> fit_step(const float* values, int count, double start, double blur, bool free_blur) {
  const int unknowns = free_blur ? 4 : 3;
  if (count < unknowns + 2) return std::nullopt;
  Eigen::Vector4d p(values[0], values[count - 1] - values[0], start, blur);  // outside, step, position, blur
  if (std::abs(p[1]) < 1e-9) return std::nullopt;
  const double reach = 1.5 + blur;
  Eigen::Matrix4d normal;
  double squares = 0.0;
  bool settled = false;
  for (int iteration = 0; iteration < 12 && !settled; ++iteration) {
    normal.setZero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    squares = 0.0;
    for (int i = 0; i < count; ++i) {
      const double z = (i - p[2]) / p[3];
      const double phi = normal_distribution(z), density = normal_density(z);
      const Eigen::Vector4d g(1.0, phi, -p[1] * density / p[3], -p[1] * density * z / p[3]);
      const double r = values[i] - p[0] - p[1] * phi;
      normal.noalias() += g * g.transpose();
      right.noalias() += r * g;
      squares += r * r;
    }
    if (!free_blur) normal.row(3).setZero(), normal.col(3).setZero(), normal(3, 3) = 1, right[3] = 0;
    const Eigen::LDLT<Eigen::Matrix4d> solver(normal);
    if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 1e-12)) return std::nullopt;
    Eigen::Vector4d step = solver.solve(right);
    step[2] = std::clamp(step[2], -1.0, 1.0);
    step[3] = std::clamp(step[3], -0.4 * p[3], 0.4 * p[3]);
    p += step;
    if (!(std::abs(p[2] - start) < reach) || !(p[3] > 0.15) || p[3] > 20) return std::nullopt;
    settled = std::abs(step[2]) < 1e-4 && (!free_blur || std::abs(step[3]) < 1e-3);
  }
  if (!settled || p[1] <= 0) return std::nullopt;
  StepFit fit;
  fit.outside = p[0], fit.step = p[1], fit.position = p[2], fit.blur = p[3];
  fit.residual = std::sqrt(squares / (count - unknowns));
  const Eigen::Vector4d column = normal.ldlt().solve(Eigen::Vector4d::Unit(2));
  fit.sigma_unit = std::sqrt(std::max(0.0, column[2]));
  return fit;
}

std::optional<double> zero_crossing(const float* values, int count, double start, int arm, double half_width) {
  const int first = 2 * arm, last = count - 1 - 2 * arm;
  double at = start;
  for (int pass = 0; pass < 3; ++pass) {  // the stretch of the line moves with the crossing
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    const int from = std::max(first, static_cast<int>(std::ceil(at - half_width)));
    const int to = std::min(last, static_cast<int>(std::floor(at + half_width)));
    for (int i = from; i <= to; ++i) {
      const double x = i - at, second = values[i + 2 * arm] - 2.0 * values[i] + values[i - 2 * arm];
      n += 1, sx += x, sy += second, sxx += x * x, sxy += x * second;
    }
    const double det = n * sxx - sx * sx;
    if (n < 3 || !(det > 0)) return std::nullopt;
    const double slope = (n * sxy - sx * sy) / det;
    if (!(slope < 0)) return std::nullopt;  // from the rise's foot to its head the second derivative falls
    at += (sx - sy / slope) / n;
    if (!(std::abs(at - start) < 2 * half_width)) return std::nullopt;
  }
  return at;
}

}  // namespace imprint
