#include "survey/eccentricity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include <ceres/ceres.h>
#include <Eigen/Geometry>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

constexpr int kFewestSights = 4;
constexpr double kDiameterShare = 0.005, kDiameterFloor_px = 0.05;  // what a mean diameter is off (ours)
constexpr double kTurnSigma = 1.0;     // tangent by which a normal may differ from its start (ours)
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
    residual[1] = disc[1] / kTurnSigma;
    residual[2] = disc[2] / kTurnSigma;
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

// What one sight tells of its target's disc.
struct SizeSeen {
  Eigen::Matrix<double, 2, 3> projection;
  Eigen::Vector3d back;  // direction from the target to the camera
  double diameter_px = 0.0, sigma_px = 0.0;
};

// Mean diameter of the image of a disc of radius 1.
double unit_diameter(const Eigen::Matrix<double, 2, 3>& projection, const Eigen::Vector3d& normal) {
  const Eigen::Matrix2d a =
      projection * (Eigen::Matrix3d::Identity() - normal * normal.transpose()) * projection.transpose();
  return std::sqrt(a.trace() + 2.0 * std::sqrt(std::max(0.0, a.determinant())));
}

// The best of normals spread over all that every camera sees from the front; the tilt's sizes have several minima.
std::optional<Eigen::Vector3d> start_normal(const std::vector<SizeSeen>& seen, double radius, double radius_sigma) {
  constexpr int kRings = 8, kAround = 24;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const SizeSeen& size : seen) middle += size.back;
  const Eigen::Vector3d axis = middle.normalized(), side = axis.unitOrthogonal(), up = axis.cross(side);
  std::optional<Eigen::Vector3d> best;
  double least = 1e300;
  for (int i = 0; i < kRings * kAround; ++i) {
    const double tilt = 0.5 * std::numbers::pi * (i / kAround) / kRings,
                 around = 2.0 * std::numbers::pi * (i % kAround) / kAround;
    const Eigen::Vector3d n =
        std::cos(tilt) * axis + std::sin(tilt) * (std::cos(around) * side + std::sin(around) * up);
    if (std::any_of(seen.begin(), seen.end(), [&](const SizeSeen& size) { return size.back.dot(n) < 0.05; })) continue;
    double sum_aa = 1.0 / (radius * radius * radius_sigma * radius_sigma);
    double sum_ab = sum_aa * radius;
    std::vector<double> units;
    for (const SizeSeen& size : seen) {
      units.push_back(unit_diameter(size.projection, n) / size.sigma_px);
      sum_aa += units.back() * units.back();
      sum_ab += units.back() * size.diameter_px / size.sigma_px;
    }
    const double fitted = sum_ab / sum_aa;
    const double off_radius = (fitted / radius - 1.0) / radius_sigma;
    double cost = std::log1p(off_radius * off_radius);
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const double off = units[k] * fitted - seen[k].diameter_px / seen[k].sigma_px;
      cost += std::log1p(0.25 * off * off);
    }
    if (cost < least) {
      least = cost;
      best = n;
    }
  }
  return best;
}

std::optional<DotDisc> find_disc(const Network& network, const std::vector<const Sight*>& sights,
                                 const Eigen::Vector3d& p, double log_radius, double radius_sigma) {
  std::vector<SizeSeen> seen;
  for (const Sight* sight : sights) {
    const CameraPose& pose = *network.poses[sight->photo];
    seen.push_back({projection_slope(network.camera, pose, p), (pose.center_world_mm - p).normalized(),
                    sight->dot_diameter_px, kDiameterFloor_px + kDiameterShare * sight->dot_diameter_px});
  }
  const auto start = start_normal(seen, std::exp(log_radius), radius_sigma);
  if (!start) return std::nullopt;
  const Eigen::Vector3d side = start->unitOrthogonal(), up = start->cross(side);
  std::array<double, 3> disc{log_radius, 0.0, 0.0};
  ceres::Problem problem;
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<DiscExpectation, 3, 3>(new DiscExpectation{log_radius, radius_sigma}), nullptr,
      disc.data());
  for (const SizeSeen& size : seen)
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DiameterError, 1, 3>(
                                 new DiameterError{size.projection, *start, side, up, size.diameter_px, size.sigma_px}),
                             new ceres::CauchyLoss(2.0), disc.data());
  ceres::Solver::Options how;
  how.linear_solver_type = ceres::DENSE_QR;
  how.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  return DotDisc{std::exp(disc[0]), (*start + disc[1] * side + disc[2] * up).normalized(),
                 static_cast<int>(sights.size())};
}

}  // namespace

DotDiscs find_dot_discs(const Network& network, const std::vector<Sight>& sights) {
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
  DotDiscs discs;
  for (const auto& [id, seen] : of_target) {
    // A dot of quite another size is of another print run and stands for itself.
    const bool another = std::abs(rough[id] - common) > 0.25;
    const auto disc =
        find_disc(network, seen, network.points.at(id), another ? rough[id] : common, another ? 0.3 : kRadiusSigma);
    if (disc) discs[id] = *disc;
  }
  return discs;
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
