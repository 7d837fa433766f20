#include "fusion/comparison/cloud_sections.h"

#include <algorithm>
#include <bitset>
#include <cmath>

#include <Eigen/Dense>

namespace imprint {
namespace {

constexpr int kOrders = 5;                  // harmonics 2 to 6
constexpr int kUnknowns = 3 + 2 * kOrders;  // radius, centre, harmonics
constexpr std::size_t kSectors = 36, kSectorsNeeded = 24;
constexpr double kOutOfRoundShare = 0.01;  // sigma of the second harmonic, of the radius
constexpr int kLeastPoints = 3 * kUnknowns;
using Terms = Eigen::Matrix<double, kUnknowns, 1>;

Terms terms_at(double theta) {
  Terms terms;
  terms << 1.0, std::cos(theta), std::sin(theta), Eigen::Matrix<double, 2 * kOrders, 1>::Zero();
  for (int k = 0; k < kOrders; ++k) {
    terms(3 + 2 * k) = std::cos((k + 2) * theta);
    terms(4 + 2 * k) = std::sin((k + 2) * theta);
  }
  return terms;
}

/// Mean over directions of the section's widths: its girth over pi. More than twice the mean radius when out of round.
double mean_width(const Terms& fit) {
  constexpr int kPoints = 180;
  double girth = 0.0;
  Eigen::Vector2d before = fit.dot(terms_at(0.0)) * Eigen::Vector2d::UnitX();
  for (int i = 1; i <= kPoints; ++i) {
    const double theta = 2.0 * M_PI * i / kPoints;
    const Eigen::Vector2d here = fit.dot(terms_at(theta)) * Eigen::Vector2d(std::cos(theta), std::sin(theta));
    girth += (here - before).norm();
    before = here;
  }
  // The chords of a circle are shorter than its arcs.
  return girth / (kPoints * std::sin(M_PI / kPoints));
}

/// Half of the largest less the smallest width, and its standard deviation by the two widths' own.
std::pair<double, double> circularity_of(const Terms& fit,
                                         const Eigen::Matrix<double, kUnknowns, kUnknowns>& covariance) {
  double narrow = 1e300, wide = -1e300;
  Terms at_narrow = Terms::Zero(), at_wide = Terms::Zero();
  for (int d = 0; d < 90; ++d) {
    const double theta = M_PI * d / 90.0;
    const Terms width = terms_at(theta) + terms_at(theta + M_PI);
    const double value = width.dot(fit);
    if (value < narrow) narrow = value, at_narrow = width;
    if (value > wide) wide = value, at_wide = width;
  }
  const Terms difference = 0.5 * (at_wide - at_narrow);
  return {difference.dot(fit), std::sqrt(difference.dot(covariance * difference))};
}

}  // namespace

SortedCloud::SortedCloud(std::vector<Eigen::Vector3d> points_mm) : points_(std::move(points_mm)) {
  std::ranges::sort(points_, {}, [](const Eigen::Vector3d& p) { return p.x(); });
}

std::optional<CloudSection> SortedCloud::cut(double x_mm, double width_mm) const {
  const auto x_of = [](const Eigen::Vector3d& p) { return p.x(); };
  const auto from = std::ranges::lower_bound(points_, x_mm - 0.5 * width_mm, {}, x_of);
  const auto to = std::ranges::upper_bound(points_, x_mm + 0.5 * width_mm, {}, x_of);
  std::vector<Eigen::Vector2d> slice;
  for (auto point = from; point != to; ++point) slice.emplace_back(point->tail<2>());
  if (slice.size() < static_cast<std::size_t>(kLeastPoints)) return std::nullopt;

  // A circle first, by its equation in the squares, then its radius with harmonics about that centre.
  Eigen::Vector2d center;
  {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const Eigen::Vector2d near = slice.front();
    for (const Eigen::Vector2d& p : slice) {
      const Eigen::Vector2d q = p - near;
      const Eigen::Vector3d row(q.x(), q.y(), 1.0);
      normal += row * row.transpose();
      right += row * q.squaredNorm();
    }
    const Eigen::Vector3d circle = normal.ldlt().solve(right);
    center = near + 0.5 * circle.head<2>();
    if (!center.allFinite()) return std::nullopt;
  }
  double radius = 0.0;
  for (const Eigen::Vector2d& p : slice) radius += (p - center).norm() / static_cast<double>(slice.size());
  Terms fit = Terms::Zero();
  double sigma = 1e300;
  Eigen::Matrix<double, kUnknowns, kUnknowns> normal;
  int used = 0;
  for (int iteration = 0; iteration < 6; ++iteration) {
    normal.setZero();
    Terms right = Terms::Zero();
    std::bitset<kSectors> sectors;
    std::vector<std::pair<Terms, double>> rows;
    for (const Eigen::Vector2d& p : slice) {
      const Eigen::Vector2d q = p - center;
      const double theta = std::atan2(q.y(), q.x());
      const Terms terms = terms_at(theta);
      if (iteration > 0 && std::abs(q.norm() - terms.dot(fit)) > 3.0 * sigma) continue;
      rows.emplace_back(terms, q.norm());
      normal += terms * terms.transpose();
      right += terms * q.norm();
      sectors.set(static_cast<std::size_t>((theta / (2.0 * M_PI) + 0.5) * kSectors) % kSectors);
    }
    used = static_cast<int>(rows.size());
    if (used < kLeastPoints || sectors.count() < kSectorsNeeded) return std::nullopt;
    // Where the cloud has a gap, underneath, harmonics and radius are told apart only by how far out of round a forging
    // may be.
    for (int k = 0; k < kOrders; ++k) {
      const double likely = kOutOfRoundShare * radius * 2.0 / (k + 2);
      normal.diagonal().segment<2>(3 + 2 * k).array() += std::min(sigma * sigma, likely * likely) / (likely * likely);
    }
    fit = normal.ldlt().solve(right);
    double squares = 0.0;
    for (const auto& [terms, distance] : rows) squares += std::pow(distance - terms.dot(fit), 2);
    sigma = std::sqrt(squares / std::max(1, used - kUnknowns));
    center += fit.segment<2>(1);
    fit.segment<2>(1).setZero();
    if (!fit.allFinite()) return std::nullopt;
  }
  const Eigen::Matrix<double, kUnknowns, kUnknowns> covariance =
      sigma * sigma * normal.ldlt().solve(Eigen::Matrix<double, kUnknowns, kUnknowns>::Identity());
  constexpr double kCi95 = 1.959964, kCi95Plane = 2.447747;
  const auto [circularity, circularity_sigma] = circularity_of(fit, covariance);
  return CloudSection{.x_mm = x_mm,
                      .center_mm = center,
                      .diameter_mm = mean_width(fit),
                      .circularity_mm = circularity,
                      .axis_ci95_mm = kCi95Plane * std::sqrt(0.5 * (covariance(1, 1) + covariance(2, 2))),
                      .diameter_ci95_mm = 2.0 * kCi95 * std::sqrt(covariance(0, 0)),
                      .circularity_ci95_mm = kCi95 * circularity_sigma,
                      .points = used};
}

}  // namespace imprint
