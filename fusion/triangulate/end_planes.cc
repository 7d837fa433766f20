#include "fusion/triangulate/end_planes.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

constexpr int kFaceUnknowns = 6;  // x and two tilts, first and last

/// Middle reading of one end in one observation, or of all observations.
double median_x(std::span<const EndPoint> points, bool last) {
  std::vector<double> x;
  for (const EndPoint& point : points)
    if (point.last == last) x.push_back(point.x_mm);
  return median(std::move(x));
}

}  // namespace

double EndPlanes::length_sigma_mm() const {
  return std::sqrt(std::max(0.0, covariance_mm2(0, 0) + covariance_mm2(1, 1) - 2.0 * covariance_mm2(0, 1)));
}

EndPlanes fit_end_planes(std::span<const EndPoint> points, int observations, const EndPriors& priors) {
  EndPlanes planes;
  planes.shift_mm.assign(static_cast<std::size_t>(std::max(observations, 1)), 0.0);
  for (const EndPoint& point : points) (point.last ? planes.last : planes.first).seen = true;

  const int unknowns = kFaceUnknowns + std::max(0, observations - 1);
  Eigen::VectorXd start = Eigen::VectorXd::Zero(unknowns);
  start(0) = median_x(points, false);
  start(3) = median_x(points, true);
  Eigen::VectorXd solution = start;
  Eigen::MatrixXd normal(unknowns, unknowns);
  std::vector<double> trust(points.size(), 1.0);
  constexpr int kIterations = 12;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    normal.setZero();
    Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
    const double tilt_information = 1.0 / (priors.tilt_sigma_rad * priors.tilt_sigma_rad);
    for (const int tilt : {1, 2, 4, 5}) normal(tilt, tilt) += tilt_information;
    for (int k = kFaceUnknowns; k < unknowns; ++k)
      normal(k, k) += 1.0 / (priors.shift_sigma_mm * priors.shift_sigma_mm);
    // An end that nobody read stays where it was put, without a say.
    normal(0, 0) += 1e-12;
    normal(3, 3) += 1e-12;
    Eigen::VectorXd row(unknowns);
    double chi2 = 0.0;
    double used = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const EndPoint& point = points[i];
      row.setZero();
      const int face = point.last ? 3 : 0;
      row(face) = 1.0;
      row.segment<2>(face + 1) = point.beside_mm;
      if (point.observation > 0) row(kFaceUnknowns + point.observation - 1) = -1.0;
      const double variance = point.sigma_mm * point.sigma_mm + priors.scatter_mm * priors.scatter_mm;
      const double residual = point.x_mm - row.dot(solution);
      // Cauchy weights from the second round on: a covered end is read far off.
      if (iteration > 0) trust[i] = 1.0 / (1.0 + residual * residual / (variance * 6.0));
      chi2 += trust[i] * residual * residual / variance;
      used += trust[i];
      normal += trust[i] / variance * row * row.transpose();
      right += trust[i] / variance * row * (point.x_mm - row.dot(start));
    }
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(normal);
    solution = start + ldlt.solve(right);
    if (iteration + 1 == kIterations) {
      // Readings that scatter more than they claim widen the interval.
      const double freedom = std::max(1.0, used - 2.0 - 0.5 * (observations - 1));
      const double spread = std::max(1.0, chi2 / freedom);
      const Eigen::MatrixXd covariance = ldlt.solve(Eigen::MatrixXd::Identity(unknowns, unknowns)) * spread;
      planes.covariance_mm2 << covariance(0, 0), covariance(0, 3), covariance(3, 0), covariance(3, 3);
    }
  }
  planes.first.x_mm = solution(0);
  planes.first.tilt = solution.segment<2>(1);
  planes.last.x_mm = solution(3);
  planes.last.tilt = solution.segment<2>(4);
  for (int k = 1; k < observations; ++k) planes.shift_mm[static_cast<std::size_t>(k)] = solution(kFaceUnknowns + k - 1);
  return planes;
}

}  // namespace imprint
