#include "node/detect/ring_light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include "lib/targets/code_distance.h"

namespace imprint {
namespace {

constexpr double evenness = 0.3;      // weight of an even light beside that of a white bit
constexpr double unevenness = 0.01;   // of paint, as a standard deviation of the logarithm, ours
constexpr double prior_readings = 2;  // by which that is known before any scatter is seen
constexpr double bent_light = 0.003;  // by how much light bends over the ring, in slopes per dot radius

struct WhiteBit {
  Eigen::Vector3d row;  // of level and slope
  double logarithm;
};

std::vector<WhiteBit> white_bits(const RingScan& scan, std::uint32_t code) {
  const int bits = static_cast<int>(scan.reading.size());
  std::vector<WhiteBit> white;
  for (int i = 0; i < bits; ++i) {
    if (bit_at(code, bits, i) == 0) continue;
    const auto at = static_cast<std::size_t>(i);
    const BitResponse& response = scan.response[at];
    const double even = response.own + response.beside * (bit_at(code, bits, i - 1) + bit_at(code, bits, i + 1));
    const double ratio = (scan.reading[at] - response.floor) / even;
    constexpr double least = 0.1;
    if (!(ratio > least)) continue;
    white.push_back({{1.0, scan.place[at].x(), scan.place[at].y()}, std::log(ratio)});
  }
  return white;
}

}  // namespace

std::optional<RingLight> light_on_ring(const RingScan& scan, std::uint32_t code) {
  const std::vector<WhiteBit> white = white_bits(scan, code);
  if (white.size() < 2) return std::nullopt;
  Eigen::Matrix3d normal = Eigen::Vector3d(0.1, evenness, evenness).asDiagonal();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const WhiteBit& bit : white) {
    normal += bit.row * bit.row.transpose();
    right += bit.logarithm * bit.row;
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
  const Eigen::Vector3d fitted = solver.solve(right);
  RingLight light{std::exp(fitted[0]), fitted.tail<2>(), std::numeric_limits<double>::infinity()};
  const double free = static_cast<double>(white.size()) - 3.0;
  if (free < 1.0) return light;
  double squares = prior_readings * (unevenness * unevenness + scan.noise * scan.noise);
  for (const WhiteBit& bit : white) squares += std::pow(bit.logarithm - bit.row.dot(fitted), 2);
  const Eigen::Matrix3d inverse = solver.solve(Eigen::Matrix3d::Identity());
  const double largest = std::max(inverse(1, 1), inverse(2, 2));
  light.slope_sigma = std::hypot(bent_light, std::sqrt(largest * squares / (free + prior_readings)));
  return light;
}

}  // namespace imprint
