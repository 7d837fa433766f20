#include "node/resect/resect.h"

#include <algorithm>
#include <cmath>

#include <fmt/ranges.h>
#include <Eigen/Cholesky>

#include "lib/geometry/median.h"
#include "node/resect/start_pose.h"

namespace imprint {
namespace {

// One target with what the adjustment needs of it.
struct Observation {
  int id = 0;
  ObservedPoint seen;
  IdealPoint ideal;
  Eigen::Vector3d p_world_mm;
  double sigma_px = 0.0;        // detection and noise floor
  double field_sigma_mm = 0.0;  // of the target's coordinates
  bool used = true;
  ObservedPoint eccentricity_px{};  // of the dot's image, where its disc is known
};

using Jacobian = Eigen::Matrix<double, 2, 6>;

// Residual (observed minus projected, ideal px) and its derivative by (center, rotation vector).
Eigen::Vector2d residual(const Observation& o, const CameraPose& pose, double focal_length_px, Jacobian* jacobian) {
  const Eigen::Vector3d p = pose.cam_from_world(o.p_world_mm);
  const double f = focal_length_px;
  if (jacobian != nullptr) {
    Eigen::Matrix<double, 2, 3> by_p;
    by_p << f / p.z(), 0.0, -f * p.x() / (p.z() * p.z()), 0.0, f / p.z(), -f * p.y() / (p.z() * p.z());
    jacobian->leftCols<3>() = by_p * pose.R_cam_world;  // dp/dcenter = -R, and the residual is minus the projection
    jacobian->rightCols<3>() = by_p * cross_matrix(p);  // dp/dd = -[p]x
  }
  return {o.ideal.x_px - f * p.x() / p.z(), o.ideal.y_px - f * p.y() / p.z()};
}

double sigma_px(const Observation& o, const CameraPose& pose, double focal_length_px) {
  const double distance_mm = pose.cam_from_world(o.p_world_mm).norm();
  return std::hypot(o.sigma_px, focal_length_px * o.field_sigma_mm / distance_mm);
}

bool in_front(const std::vector<Observation>& observations, const CameraPose& pose) {
  return std::all_of(observations.begin(), observations.end(),
                     [&](const Observation& o) { return !o.used || pose.cam_from_world(o.p_world_mm).z() > 1.0; });
}

struct NormalEquations {
  Matrix6d matrix = Matrix6d::Zero();
  Vector6d right = Vector6d::Zero();
  double cost = 0.0;  // sum of log(1 + r^2/(k s)^2), Cauchy
};

constexpr double kCauchyScale = 2.385;  // in sigmas: 95 % efficiency for normal residuals

NormalEquations accumulate(const std::vector<Observation>& observations, const CameraPose& pose, double f,
                           double scale) {
  NormalEquations sum;
  for (const Observation& o : observations) {
    if (!o.used) continue;
    Jacobian j;
    const Eigen::Vector2d r = residual(o, pose, f, &j);
    const double sigma = sigma_px(o, pose, f) * scale;
    const double ratio = r.squaredNorm() / (sigma * sigma * kCauchyScale * kCauchyScale);
    const double weight = 1.0 / (sigma * sigma * (1.0 + ratio));
    sum.matrix += weight * j.transpose() * j;
    sum.right -= weight * j.transpose() * r;
    sum.cost += std::log1p(ratio);
  }
  return sum;
}

CameraPose moved(const CameraPose& pose, const Vector6d& step) {
  CameraPose result = pose;
  result.center_world_mm += step.head<3>();
  result.R_cam_world = rotation_from_vector(step.tail<3>()) * pose.R_cam_world;
  return result;
}

// Levenberg-Marquardt on the Cauchy cost; `scale` multiplies every sigma.
CameraPose adjust(const std::vector<Observation>& observations, CameraPose pose, double f, double scale) {
  NormalEquations now = accumulate(observations, pose, f, scale);
  double damping = 1e-4;
  for (int iteration = 0; iteration < 60 && damping < 1e12; ++iteration) {
    Matrix6d matrix = now.matrix;
    matrix.diagonal() *= 1.0 + damping;
    const Vector6d step = matrix.ldlt().solve(now.right);
    if (!step.allFinite()) break;
    const CameraPose next = moved(pose, step);
    const NormalEquations then = accumulate(observations, next, f, scale);
    if (!in_front(observations, next) || !(then.cost <= now.cost)) {
      damping *= 10.0;
      continue;
    }
    const bool settled = step.head<3>().norm() < 1e-7 && step.tail<3>().norm() < 1e-11;
    pose = next;
    now = then;
    damping = std::max(damping * 0.1, 1e-9);
    if (settled) break;
  }
  return pose;
}

// How much larger the residuals are than their sigmas, robustly; at least 1.
double residual_scale(const std::vector<Observation>& observations, const CameraPose& pose, double f) {
  std::vector<double> ratios;
  for (const Observation& o : observations) {
    if (o.used) ratios.push_back(residual(o, pose, f, nullptr).norm() / sigma_px(o, pose, f));
  }
  const double redundancy = std::sqrt(2.0 * static_cast<double>(ratios.size()) /
                                      std::max(1.0, 2.0 * static_cast<double>(ratios.size()) - 6.0));
  constexpr double kRayleighMedian = 1.1774;  // of a 2D normal residual's length, in sigmas
  return std::max(1.0, redundancy * median(ratios) / kRayleighMedian);
}

int count_used(const std::vector<Observation>& observations) {
  return static_cast<int>(
      std::count_if(observations.begin(), observations.end(), [](const Observation& o) { return o.used; }));
}

// Marks what does not fit the pose; true when the marks changed.
bool update_used(std::vector<Observation>& observations, const CameraPose& pose, double f, double scale,
                 const ResectConfig& config) {
  bool changed = false;
  for (Observation& o : observations) {
    const bool front = pose.cam_from_world(o.p_world_mm).z() > 1.0;
    const double r = front ? residual(o, pose, f, nullptr).norm() : config.max_residual_px;
    const bool used = r < std::min(config.max_residual_px, config.reject_sigmas * scale * sigma_px(o, pose, f));
    changed = changed || used != o.used;
    o.used = used;
  }
  return changed;
}

// The centre of a dot's image is not the image of its centre.
void correct_eccentricity(std::vector<Observation>& observations, const CameraModel& camera, const CameraPose& pose,
                          const DotDiscs& dots) {
  for (Observation& o : observations) {
    const auto disc = dots.find(o.id);
    if (disc == dots.end() || !(pose.cam_from_world(o.p_world_mm).z() > 2.0 * disc->second.radius)) continue;
    o.eccentricity_px = eccentricity_px(camera, pose, o.p_world_mm, disc->second);
    o.ideal = undistort(camera, {o.seen.x_px - o.eccentricity_px.x_px, o.seen.y_px - o.eccentricity_px.y_px});
  }
}

// Adjusts and leaves out what does not fit, until it is the same targets. Returns the scale of the residuals.
double settle(std::vector<Observation>& observations, CameraPose& pose, double f, const ResectConfig& config) {
  double scale = 1.0;
  for (int round = 0; round < 10; ++round) {
    if (count_used(observations) < config.min_targets) break;
    scale = residual_scale(observations, pose, f);
    pose = adjust(observations, pose, f, scale);
    scale = residual_scale(observations, pose, f);
    if (!update_used(observations, pose, f, scale, config)) break;
  }
  return scale;
}

Resection describe(const CameraModel& camera, const std::vector<Observation>& observations, const CameraPose& pose) {
  Resection result;
  result.pose = pose;
  double sum = 0.0;
  for (const Observation& o : observations) {
    const Eigen::Vector3d p_cam = pose.cam_from_world(o.p_world_mm);
    ResectedTarget target{o.id, 0.0, 0.0, o.used};
    if (p_cam.z() > 0) {
      const ObservedPoint expected = project(camera, p_cam);
      target.dx_px = o.seen.x_px - o.eccentricity_px.x_px - expected.x_px;
      target.dy_px = o.seen.y_px - o.eccentricity_px.y_px - expected.y_px;
    }
    if (o.used) sum += target.dx_px * target.dx_px + target.dy_px * target.dy_px;
    result.targets.push_back(target);
  }
  result.reprojection_rms_px = std::sqrt(sum / count_used(observations));
  return result;
}

std::string ids_of(const std::vector<Observation>& observations) {
  std::vector<int> ids;
  for (const Observation& o : observations) {
    if (o.used) ids.push_back(o.id);
  }
  return ids.empty() ? "none" : fmt::format("{}", fmt::join(ids, ", "));
}

}  // namespace

Result<void> ResectConfig::validate() const {
  if (min_targets < 4) return invalid_input("resect.min_targets: expected at least 4, found {}", min_targets);
  if (!(max_residual_px > 0))
    return invalid_input("resect.max_residual_px: expected a positive number, found {}", max_residual_px);
  if (!(noise_floor_px > 0))
    return invalid_input("resect.noise_floor_px: expected a positive number, found {}", noise_floor_px);
  if (!(reject_sigmas > 1)) return invalid_input("resect.reject_sigmas: expected more than 1, found {}", reject_sigmas);
  return {};
}

Result<Resection> resect(const CameraModel& camera, const std::vector<DetectedTarget>& detected,
                         const TargetField& field, const ResectConfig& config, const DotDiscs& dots) {
  if (auto valid = config.validate(); !valid) return pass_on(valid.error());
  const double f = camera.focal_length_px;
  std::vector<Observation> observations;
  std::vector<Correspondence> correspondences;
  std::vector<int> unknown_ids;
  for (const DetectedTarget& target : detected) {
    const auto known = field.targets.find(target.id);
    if (known == field.targets.end()) {
      unknown_ids.push_back(target.id);
      continue;
    }
    const IdealPoint ideal = undistort(camera, target.center);
    observations.push_back({target.id, target.center, ideal, known->second.p_world_mm,
                            std::hypot(target.sigma_px, config.noise_floor_px), known->second.sigma_mm.value_or(0.0),
                            true});
    correspondences.push_back({{ideal.x_px / f, ideal.y_px / f}, known->second.p_world_mm});
  }
  const std::string strangers =
      unknown_ids.empty() ? "" : fmt::format("; ids not in the field: {}", fmt::join(unknown_ids, ", "));
  if (count_used(observations) < config.min_targets) {
    return job_failed(
        "camera \"{}\": {} usable targets ({}), expected at least {} of the field's{}; clean or uncover the targets",
        camera.id, observations.size(), ids_of(observations), config.min_targets, strangers);
  }
  const auto start = start_pose(correspondences, 2.0 * config.max_residual_px / f, config.min_targets);
  if (!start) {
    return job_failed(
        "camera \"{}\": the {} targets seen ({}) contradict each other: no pose agrees with {} of them; check that "
        "the field file, the calibration and the image belong together{}",
        camera.id, observations.size(), ids_of(observations), config.min_targets, strangers);
  }
  CameraPose pose = *start;
  ResectConfig first = config;  // the start pose is rough: judge by the wide limit alone
  first.max_residual_px *= 2.0;
  first.reject_sigmas = 1e9;
  update_used(observations, pose, f, 1.0, first);
  double scale = settle(observations, pose, f, config);
  if (!dots.empty() && count_used(observations) >= config.min_targets) {
    correct_eccentricity(observations, camera, pose, dots);
    scale = settle(observations, pose, f, config);
  }
  if (count_used(observations) < config.min_targets) {
    return job_failed("camera \"{}\": only {} targets ({}) agree on a pose to {} px, expected at least {}{}", camera.id,
                      count_used(observations), ids_of(observations), config.max_residual_px, config.min_targets,
                      strangers);
  }
  const NormalEquations last = accumulate(observations, pose, f, scale);
  pose.covariance = last.matrix.ldlt().solve(Matrix6d::Identity());
  if (!pose.covariance.allFinite() || pose.covariance.diagonal().minCoeff() <= 0) {
    return job_failed("camera \"{}\": the {} targets ({}) do not fix a pose: they lie nearly on a line", camera.id,
                      count_used(observations), ids_of(observations));
  }
  Resection result = describe(camera, observations, pose);
  result.unknown_ids = std::move(unknown_ids);
  return result;
}

}  // namespace imprint
