#include "node/edge/subpixel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace imprint {
namespace {

double normal_density(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi); }
double normal_distribution(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

/// The root of the depth, blurred by a normal distribution of width 1, and its slope: tables, as they have no closed
/// form in elementary functions.
class BlurredRoot {
 public:
  BlurredRoot() {
    for (std::size_t k = 0; k < kCount; ++k) {
      const double z = kLow + kStep * static_cast<double>(k);
      value_[k] = integral(z, [](double u) { return u * u; });
      slope_[k] = integral(z, [z](double u) { return u * u * (u * u - z); });
    }
  }
  struct At {
    double value, slope;
  };
  [[nodiscard]] At at(double z) const {
    if (z <= kLow) return {0.0, 0.0};
    if (z >= kHigh) {
      const double root = std::sqrt(z);
      return {root * (1.0 - 0.125 / (z * z)), 0.5 / root * (1.0 + 0.375 / (z * z))};
    }
    const double place = (z - kLow) / kStep;
    const auto k = std::min(static_cast<std::size_t>(place), kCount - 2);
    const double t = place - static_cast<double>(k);
    return {(1 - t) * value_[k] + t * value_[k + 1], (1 - t) * slope_[k] + t * slope_[k + 1]};
  }

 private:
  static constexpr double kLow = -5.0, kHigh = 7.0, kStep = 0.02;
  static constexpr std::size_t kCount = 601;
  /// Integral of f(u) 2 du phi(u^2 - z): with depth u^2 the root has no kink at the rim.
  template <class F>
  static double integral(double z, F f) {
    constexpr int kSteps = 400;
    const double top = std::sqrt(std::max(z, 0.0) + 6.0), h = top / kSteps;
    double sum = 0.0;
    for (int i = 0; i <= kSteps; ++i) {
      const double u = h * i;
      sum += (i == kSteps || i == 0 ? 0.5 : 1.0) * 2.0 * f(u) * normal_density(u * u - z);
    }
    return sum * h;
  }
  std::array<double, kCount> value_{}, slope_{};
};

const BlurredRoot& blurred_root() {
  static const BlurredRoot table;
  return table;
}

/// A step with its rise at z = (i - position)/blur, for a step of 1, and its slopes.
struct ShapeAt {
  double value, by_z;
  double root;  ///< what a rise of 1 adds
};
ShapeAt shape_at(double z, const EdgeShape& shape) {
  if (shape.rise == 0.0) return {normal_distribution(z), normal_density(z), 0.0};
  const auto root = blurred_root().at(z);
  const double scale = std::sqrt(shape.blur);
  return {normal_distribution(z) + shape.rise * scale * root.value, normal_density(z) + shape.rise * scale * root.slope,
          scale * root.value};
}

std::optional<StepFit> fit(const float* values, int count, double start, EdgeShape shape, bool free_blur) {
  const int unknowns = free_blur ? 4 : 3;
  if (count < unknowns + 2) return std::nullopt;
  Eigen::Vector4d p(values[0], values[count - 1] - values[0], start, shape.blur);  // outside, step, position, blur
  if (std::abs(p[1]) < 1e-9) return std::nullopt;
  const double reach = 1.5 + shape.blur;
  Eigen::Matrix4d normal;
  double squares = 0.0;
  bool settled = false;
  for (int iteration = 0; iteration < 12 && !settled; ++iteration) {
    normal.setZero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    squares = 0.0;
    shape.blur = p[3];
    for (int i = 0; i < count; ++i) {
      const double z = (i - p[2]) / p[3];
      const ShapeAt at = shape_at(z, shape);
      const Eigen::Vector4d g(1.0, at.value, -p[1] * at.by_z / p[3], -p[1] * at.by_z * z / p[3]);
      const double r = values[i] - p[0] - p[1] * at.value;
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

}  // namespace

EdgeProfile edge_profile(double z, const EdgeShape& shape) {
  const ShapeAt at = shape_at(z, shape);
  const double ramp = z * normal_distribution(z) + normal_density(z);
  return {at.value, at.by_z, ramp, ramp - z};
}

std::optional<StepFit> fit_step(const float* values, int count, double start, double blur, bool free_blur) {
  return fit(values, count, start, {blur, 0.0}, free_blur);
}

std::optional<StepFit> fit_step(const float* values, int count, double start, const EdgeShape& shape) {
  return fit(values, count, start, shape, false);
}

std::optional<EdgeShape> fit_shape(std::span<const ProfilePoint> profile, double start_blur) {
  using Vector5d = Eigen::Matrix<double, 5, 1>;
  using Matrix5d = Eigen::Matrix<double, 5, 5>;
  if (profile.size() < 12) return std::nullopt;
  Vector5d p;  // outside, step, position, blur, rise times step
  p << 0.0, 1.0, 0.0, start_blur, 0.0;
  Matrix5d normal;
  double squares = 0.0, weights = 0.0;
  bool settled = false;
  for (int iteration = 0; iteration < 40 && !settled; ++iteration) {
    normal.setZero();
    Vector5d right = Vector5d::Zero();
    squares = weights = 0.0;
    const double scale = std::sqrt(p[3]);
    for (const ProfilePoint& point : profile) {
      const double z = (point.x - p[2]) / p[3];
      const auto root = blurred_root().at(z);
      const double by_z = p[1] * normal_density(z) + p[4] * scale * root.slope;
      Vector5d g;
      g << 1.0, normal_distribution(z), -by_z / p[3], -by_z * z / p[3] + 0.5 * p[4] / scale * root.value,
          scale * root.value;
      const double r = point.value - p[0] - p[1] * g[1] - p[4] * g[4];
      normal.noalias() += point.weight * g * g.transpose();
      right.noalias() += point.weight * r * g;
      squares += point.weight * r * r;
      weights += point.weight;
    }
    const Eigen::LDLT<Matrix5d> solver(normal);
    if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 1e-12 * weights)) return std::nullopt;
    Vector5d step = solver.solve(right);
    step[2] = std::clamp(step[2], -0.3, 0.3);
    step[3] = std::clamp(step[3], -0.2 * p[3], 0.2 * p[3]);
    p += step;
    if (!(std::abs(p[2]) < 2.0) || !(p[3] > 0.2) || p[3] > 8.0 || !(p[1] > 0.1)) return std::nullopt;
    settled = std::abs(step[2]) < 1e-4 && std::abs(step[3]) < 1e-4;
  }
  if (!settled) return std::nullopt;
  const double variance =
      squares / weights * static_cast<double>(profile.size()) / static_cast<double>(profile.size() - 5);
  const double mean_weight = weights / static_cast<double>(profile.size());
  const double rise_sigma =
      std::sqrt(std::max(0.0, variance * mean_weight * normal.ldlt().solve(Vector5d::Unit(4))[4]));
  if (std::abs(p[4]) < 3.0 * rise_sigma) return EdgeShape{start_blur, 0.0};
  return EdgeShape{p[3], std::clamp(p[4] / p[1], -0.3, 1.0)};
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
