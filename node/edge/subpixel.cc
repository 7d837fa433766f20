#include "node/edge/subpixel.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

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

std::optional<double> zero_crossing(const float* values, int count, double start, int lag) {
  const int n = count - 4 * lag;
  if (n < 5) return std::nullopt;
  std::vector<double> second(static_cast<std::size_t>(n));  // second[i] stands at sample i + 2 lag
  for (int i = 0; i < n; ++i)
    second[static_cast<std::size_t>(i)] = values[i + 4 * lag] - 2.0 * values[i + 2 * lag] + values[i];
  const int middle = std::clamp(static_cast<int>(std::lround(start)) - 2 * lag, 1, n - 2);
  // From the peak of the first derivative out to the two extremes of the second.
  int a = middle, b = middle;
  const auto at = [&](int i) { return second[static_cast<std::size_t>(i)]; };
  while (a > 0 && at(a - 1) > at(a)) --a;
  while (b + 1 < n && at(b + 1) < at(b)) ++b;
  const double high = at(a), low = at(b);
  if (!(high > 0 && low < 0) || b - a < 1) return std::nullopt;
  // The middle of the slope is about straight: leave out the rounded tops.
  double sw = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (int i = a; i <= b; ++i) {
    if (at(i) > 0.75 * high || at(i) < 0.75 * low) continue;
    sw += 1, sx += i, sy += at(i), sxx += static_cast<double>(i) * i, sxy += i * at(i);
  }
  double crossing = 0.0;
  const double det = sw * sxx - sx * sx;
  if (sw >= 2 && det > 1e-9 && sw * sxy - sx * sy < 0) {
    const double slope = (sw * sxy - sx * sy) / det;
    crossing = (sx - sy / slope) / sw;
  } else {
    crossing = a + (b - a) * high / (high - low);
  }
  if (!(crossing >= a && crossing <= b)) return std::nullopt;
  return crossing + 2 * lag;
}

}  // namespace imprint
