#include "survey/one_camera.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "lib/geometry/median.h"
#include "lib/geometry/rotation.h"

namespace imprint {
namespace {

constexpr std::size_t kFewest = 6;
constexpr double kCertain = 5.0;  // sigmas

using Matrix7 = Eigen::Matrix<double, 7, 7>;
using Vector7 = Eigen::Matrix<double, 7, 1>;

// Pose and focal length of one photograph, the targets where they are: Gauss and Newton, weighted against wrong ids.
FocalDeviation deviation_of(const Network& network, std::size_t photo, const std::vector<const Sight*>& sights) {
  CameraPose pose = *network.poses[photo];
  double f = network.camera.focal_length_px;
  FocalDeviation result{photo, 0.0, 1.0};
  for (int round = 0; round < 12; ++round) {
    std::vector<Eigen::Matrix<double, 2, 7>> slopes;
    std::vector<Eigen::Vector2d> residuals;
    std::vector<double> sizes;
    for (const Sight* sight : sights) {
      const Eigen::Vector3d p = pose.cam_from_world(network.points.at(sight->id));
      if (!(p.z() > 0.0)) continue;
      const IdealPoint seen = undistort(network.camera, sight->at);
      Eigen::Matrix<double, 2, 3> by_p;
      by_p << f / p.z(), 0.0, -f * p.x() / (p.z() * p.z()), 0.0, f / p.z(), -f * p.y() / (p.z() * p.z());
      Eigen::Matrix<double, 2, 7> slope;
      slope << by_p, -by_p * cross_matrix(p), f * p.head<2>() / p.z();
      slopes.push_back(slope);
      residuals.emplace_back(Eigen::Vector2d(seen.x_px, seen.y_px) - f * p.head<2>() / p.z());
      sizes.push_back(residuals.back().norm());
    }
    if (slopes.size() < kFewest) return result;
    const double sigma = std::max(1e-6, median(std::move(sizes)) / 1.1774);  // of each coordinate
    Matrix7 normal = Matrix7::Zero();
    Vector7 right = Vector7::Zero();
    for (std::size_t i = 0; i < slopes.size(); ++i) {
      const double ratio = residuals[i].norm() / (3.0 * sigma);
      const double weight = 1.0 / (1.0 + ratio * ratio);
      normal += weight * slopes[i].transpose() * slopes[i];
      right += weight * slopes[i].transpose() * residuals[i];
    }
    // Lengths differ from angles by orders of magnitude.
    const Vector7 scale = normal.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
    const auto solver = Matrix7(scale.asDiagonal() * normal * scale.asDiagonal()).ldlt();
    const Vector7 step = scale.cwiseProduct(solver.solve(scale.cwiseProduct(right)));
    const Matrix7 inverse = solver.solve(Matrix7::Identity());
    if (!step.allFinite() || !inverse.allFinite() || std::abs(step(6)) > 0.3) return result;
    pose.R_cam_world = rotation_from_vector(step.segment<3>(3)) * pose.R_cam_world;
    pose.center_world_mm -= pose.R_cam_world.transpose() * step.head<3>();
    f *= 1.0 + step(6);
    const double freedom = std::max(1.0, 2.0 * static_cast<double>(slopes.size()) - 7.0);
    const double inflation = 2.0 * static_cast<double>(slopes.size()) / freedom;
    result.share = f / network.camera.focal_length_px - 1.0;
    result.sigma = sigma * scale(6) * std::sqrt(inflation * std::max(0.0, inverse(6, 6)));
  }
  return result;
}

}  // namespace

std::vector<FocalDeviation> focal_deviations(const Network& network, const std::vector<Sight>& sights) {
  std::vector<std::vector<const Sight*>> of_photo(network.poses.size());
  for (const Sight& sight : sights)
    if (network.holds(sight)) of_photo[sight.photo].push_back(&sight);
  std::vector<FocalDeviation> result;
  for (std::size_t i = 0; i < of_photo.size(); ++i)
    if (of_photo[i].size() >= kFewest) result.push_back(deviation_of(network, i, of_photo[i]));
  return result;
}

std::vector<std::size_t> other_camera(const std::vector<FocalDeviation>& deviations, double max_spread) {
  std::vector<FocalDeviation> sorted = deviations;
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.share < b.share; });
  // Where cutting the ascending row in two separates most: difference of the weighted means over its sigma.
  std::size_t cut = 0;
  double clearest = 0.0;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    double weights[2] = {0.0, 0.0}, sums[2] = {0.0, 0.0};
    for (std::size_t k = 0; k < sorted.size(); ++k) {
      const double weight = 1.0 / (sorted[k].sigma * sorted[k].sigma + 1e-12);
      weights[k < i ? 0 : 1] += weight;
      sums[k < i ? 0 : 1] += weight * sorted[k].share;
    }
    const double apart = sums[1] / weights[1] - sums[0] / weights[0];
    const double sigma = std::sqrt(1.0 / weights[0] + 1.0 / weights[1]);
    if (apart > max_spread && apart > kCertain * sigma && apart / sigma > clearest) {
      clearest = apart / sigma;
      cut = i;
    }
  }
  std::vector<std::size_t> smaller;
  if (cut == 0) return smaller;
  const bool low = 2 * cut <= sorted.size();
  for (std::size_t k = low ? 0 : cut; k < (low ? cut : sorted.size()); ++k) smaller.push_back(sorted[k].photo);
  std::sort(smaller.begin(), smaller.end());
  return smaller;
}

}  // namespace imprint
