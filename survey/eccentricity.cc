#include "survey/eccentricity.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <ceres/ceres.h>
#include <Eigen/Geometry>

namespace imprint {
namespace {

constexpr int kFewestSights = 4;
constexpr double kDiameterShare = 0.005, kDiameterFloor_px = 0.05;  // what a mean diameter is off (ours)
constexpr double kTiltSigma = 0.6;     // tangent of the angle between a plate and the mean line of sight (ours)
constexpr double kRadiusSigma = 0.02;  // share by which dots of one print run differ (ours)

// Mean diameter of the image of a disc: its axes are the singular values of the projection within its plane.
struct DiameterError {
  Eigen::Matrix<double, 2, 3> projection;  // d(observed)/d(world) at the dot's centre
  Eigen::Vector3d towards, side, up;       // of which the normal is made
  double diameter_px, sigma_px;

  template <class T>
  bool operator()(const T* disc, T* residual) const {
    const Eigen::Matrix<T, 3, 1> normal =
        (towards.cast<T>() + disc[1] * side.cast<T>() + disc[2] * up.cast<T>()).normalized();
    const Eigen::Matrix<T, 3, 3> plane = Eigen::Matrix<T, 3, 3>::Identity() - normal * normal.transpose();
    const Eigen::Matrix<T, 2, 3> j = projection.cast<T>();
    const Eigen::Matrix<T, 2, 2> a = j * plane * j.transpose();
    const T area = a(0, 0) * a(1, 1) - a(0, 1) * a(1, 0);
    if (!(area > T(0))) return false;
    residual[0] = (exp(disc[0]) * sqrt(a.trace() + 2.0 * sqrt(area)) - diameter_px) / sigma_px;
    return true;
  }
};

struct DiscExpectation {
  double log_radius, radius_sigma;

  template <class T>
  bool operator()(const T* disc, T* residual) const {
    residual[0] = (disc[0] - log_radius) / radius_sigma;
    residual[1] = disc[1] / kTiltSigma;
    residual[2] = disc[2] / kTiltSigma;
    return true;
  }
};

Eigen::Matrix<double, 2, 3> projection_slope(const CameraModel& camera, const CameraPose& pose,
                                             const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d p = pose.cam_from_world(p_world);
  const double f = camera.focal_length_px;
  Eigen::Matrix<double, 2, 3> by_p;
  by_p << f / p.z(), 0.0, -f * p.x() / (p.z() * p.z()), 0.0, f / p.z(), -f * p.y() / (p.z() * p.z());
  return distortion_jacobian(camera, project_ideal(camera, p)) * by_p * pose.R_cam_world;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::optional<DotDisc> find_disc(const Network& network, const std::vector<const Sight*>& sights,
                                 const Eigen::Vector3d& p, double log_radius, double radius_sigma) {
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();
  for (const Sight* sight : sights) towards += (network.poses[sight->photo]->center_world_mm - p).normalized();
  if (towards.norm() < 0.1 * static_cast<double>(sights.size())) return std::nullopt;
  towards.normalize();
  const Eigen::Vector3d side = towards.unitOrthogonal(), up = towards.cross(side);
  std::array<double, 3> disc{log_radius, 0.0, 0.0};
  ceres::Problem problem;
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<DiscExpectation, 3, 3>(new DiscExpectation{log_radius, radius_sigma}), nullptr,
      disc.data());
  for (const Sight* sight : sights) {
    const double sigma = kDiameterFloor_px + kDiameterShare * sight->dot_diameter_px;
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DiameterError, 1, 3>(
                                 new DiameterError{projection_slope(network.camera, *network.poses[sight->photo], p),
                                                   towards, side, up, sight->dot_diameter_px, sigma}),
                             new ceres::CauchyLoss(2.0), disc.data());
  }
  ceres::Solver::Options how;
  how.linear_solver_type = ceres::DENSE_QR;
  how.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  return DotDisc{std::exp(disc[0]), (towards + disc[1] * side + disc[2] * up).normalized(),
                 static_cast<int>(sights.size())};
}

}  // namespace

std::map<int, DotDisc> find_dot_discs(const Network& network, const std::vector<Sight>& sights) {
  std::map<int, std::vector<const Sight*>> of_target;
  for (const Sight& sight : sights)
    if (sight.used && sight.dot_diameter_px > 0.0 && network.holds(sight)) of_target[sight.id].push_back(&sight);
  std::erase_if(of_target, [](const auto& entry) { return entry.second.size() < kFewestSights; });
  if (of_target.empty()) return {};

  // Of a dot seen aslant the mean diameter is smaller: first by the sizes as they are, then all dots as of one print.
  std::vector<double> log_radii;
  std::map<int, double> rough;
  for (const auto& [id, seen] : of_target) {
    std::vector<double> sizes;
    for (const Sight* sight : seen) {
      const double depth = network.poses[sight->photo]->cam_from_world(network.points.at(id)).z();
      sizes.push_back(std::log(0.55 * sight->dot_diameter_px * depth / network.camera.focal_length_px));
    }
    rough[id] = median(sizes);
    const auto disc = find_disc(network, seen, network.points.at(id), rough[id], 0.3);
    if (disc) log_radii.push_back(std::log(disc->radius));
  }
  if (log_radii.empty()) return {};
  const double common = median(log_radii);
  std::map<int, DotDisc> discs;
  for (const auto& [id, seen] : of_target) {
    // A dot of quite another size is of another print run and stands for itself.
    const bool another = std::abs(rough[id] - common) > 0.25;
    const auto disc =
        find_disc(network, seen, network.points.at(id), another ? rough[id] : common, another ? 0.3 : kRadiusSigma);
    if (disc) discs[id] = *disc;
  }
  return discs;
}

ObservedPoint eccentricity_px(const CameraModel& camera, const CameraPose& pose, const Eigen::Vector3d& p_world,
                              const DotDisc& disc) {
  // The image's dual conic is r^2 (I - n n') - X X' in camera axes; its centre is the third column.
  const Eigen::Vector3d p = pose.cam_from_world(p_world), n = pose.R_cam_world * disc.normal;
  const Eigen::Matrix3d plane = Eigen::Matrix3d::Identity() - n * n.transpose();
  const Eigen::Vector3d column = disc.radius * disc.radius * plane.col(2) - p * p.z();
  const Eigen::Vector2d shift = camera.focal_length_px * (column.head<2>() / column.z() - p.head<2>() / p.z());
  const Eigen::Vector2d seen = distortion_jacobian(camera, project_ideal(camera, p)) * shift;
  return {seen.x(), seen.y()};
}

void correct_eccentricity(const Network& network, std::vector<Sight>& sights) {
  const auto discs = find_dot_discs(network, sights);
  for (Sight& sight : sights) {
    const auto disc = discs.find(sight.id);
    if (disc == discs.end() || !network.holds(sight)) continue;
    const ObservedPoint shift =
        eccentricity_px(network.camera, *network.poses[sight.photo], network.points.at(sight.id), disc->second);
    sight.at.x_px += sight.eccentricity_px.x_px - shift.x_px;
    sight.at.y_px += sight.eccentricity_px.y_px - shift.y_px;
    sight.eccentricity_px = shift;
  }
}

}  // namespace imprint
