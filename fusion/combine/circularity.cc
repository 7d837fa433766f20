#include "fusion/combine/circularity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <Eigen/Dense>

namespace imprint {
namespace {

constexpr int kDirections = 60;  // over half a turn
constexpr int kDraws = 64;       // in pairs of opposite sign
constexpr std::array<int, 3> kEvenOrders{2, 4, 6};
constexpr int kTerms = 2 * static_cast<int>(kEvenOrders.size());
using Terms = Eigen::Matrix<double, kTerms, 1>;

/// Width in every direction = mean width + this times the even harmonics.
const Eigen::Matrix<double, kDirections, kTerms>& width_matrix() {
  static const auto matrix = [] {
    Eigen::Matrix<double, kDirections, kTerms> widths;
    for (int d = 0; d < kDirections; ++d) {
      const double theta = M_PI * d / kDirections;
      for (std::size_t j = 0; j < kEvenOrders.size(); ++j) {
        widths(d, static_cast<int>(2 * j)) = 2.0 * std::cos(kEvenOrders[j] * theta);
        widths(d, static_cast<int>(2 * j + 1)) = 2.0 * std::sin(kEvenOrders[j] * theta);
      }
    }
    return widths;
  }();
  return matrix;
}

const Eigen::Matrix<double, kTerms, kDraws>& normal_draws() {
  static const auto draws = [] {
    Eigen::Matrix<double, kTerms, kDraws> matrix;
    std::mt19937 generator(20221122);
    std::normal_distribution<double> normal;
    for (int j = 0; j < kDraws; j += 2) {
      for (int i = 0; i < kTerms; ++i) matrix(i, j) = normal(generator);
      matrix.col(j + 1) = -matrix.col(j);
    }
    return matrix;
  }();
  return draws;
}

}  // namespace

Circularity circularity(const NodeVector& node, const NodeMatrix& covariance) {
  Terms mean;
  Eigen::Matrix<double, kTerms, kTerms> spread;
  std::array<int, kTerms> places{};
  for (std::size_t j = 0; j < kEvenOrders.size(); ++j) {
    places[2 * j] = cosine_of(kEvenOrders[j]);
    places[2 * j + 1] = sine_of(kEvenOrders[j]);
  }
  for (int i = 0; i < kTerms; ++i) {
    mean(i) = node(places[static_cast<std::size_t>(i)]);
    for (int j = 0; j < kTerms; ++j)
      spread(i, j) = covariance(places[static_cast<std::size_t>(i)], places[static_cast<std::size_t>(j)]);
  }
  spread.diagonal().array() += 1e-18;
  const Eigen::Matrix<double, kTerms, kTerms> half = spread.llt().matrixL();
  const Eigen::Matrix<double, kTerms, kDraws> drawn = (half * normal_draws()).colwise() + mean;
  const Eigen::Matrix<double, kDirections, kDraws> widths = width_matrix() * drawn;
  const Eigen::Array<double, 1, kDraws> circularities =
      0.5 * (widths.colwise().maxCoeff() - widths.colwise().minCoeff()).array();
  Circularity result;
  result.value_mm = circularities.mean();
  result.sigma_mm = std::sqrt((circularities - result.value_mm).square().mean());
  return result;
}

}  // namespace imprint
