#include "tests/paper/calibration/monte_carlo.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "lib/geometry/rotation.h"
#include "node/resect/resect.h"
#include "tests/paper/calibration/paper_cameras.h"

namespace imprint::paper {
namespace {

constexpr int kImages = 7, kFieldTargets = 41, kPoseTargets = 8;

TargetField make_field(int targets, std::mt19937& random) {
  std::uniform_real_distribution<double> wide(-3000, 3000), deep(-1000, 1000);
  TargetField field;
  for (int id = 1; id <= targets; ++id) field.targets[id].p_world_mm = {wide(random), wide(random), deep(random)};
  return field;
}

// At `distance_mm` from the field's middle, `aside_mm` beside it and looking at it.
CameraPose pose_at(double distance_mm, double aside_mm, double roll_rad) {
  CameraPose pose;
  pose.center_world_mm = {aside_mm, 0.0, -distance_mm};
  const Eigen::Vector3d forward = -pose.center_world_mm.normalized();
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(forward).normalized();
  Eigen::Matrix3d level;
  level << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  pose.R_cam_world = rotation_from_vector({0.0, 0.0, roll_rad}) * level;
  return pose;
}

std::vector<DetectedTarget> see(const CameraModel& camera, const CameraPose& pose, const TargetField& field,
                                double noise_px, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, noise_px);
  std::vector<DetectedTarget> seen;
  for (const auto& [id, target] : field.targets) {
    const Eigen::Vector3d p = pose.cam_from_world(target.p_world_mm);
    if (p.z() < 1000.0) continue;
    const ObservedPoint at = project(camera, p);
    if (at.x_px < 30 || at.y_px < 30 || at.x_px > camera.width_px - 30 || at.y_px > camera.height_px - 30) continue;
    seen.push_back({id, {at.x_px + noise(random), at.y_px + noise(random)}, noise_px, 20.0, 0.0});
  }
  return seen;
}

Result<Calibration> calibrate_once(const CameraModel& camera, const TargetField& truth, const TargetField& used,
                                   double noise_px, std::mt19937& random) {
  std::uniform_real_distribution<double> place(-250.0, 250.0);
  std::vector<CalibrationImage> images;
  for (int k = 0; k < kImages; ++k) {
    CalibrationImage image;
    image.name = "image " + std::to_string(k);
    image.start = pose_at(8200.0 + place(random), place(random), 0.9 * k);
    for (const DetectedTarget& t : see(camera, image.start, truth, noise_px, random))
      image.points.push_back({t.id, t.center, t.sigma_px});
    images.push_back(std::move(image));
  }
  return calibrate_camera(nominal_of(camera), images, used, CalibrateConfig{});
}

std::array<double, kInteriorTerms> interior(const CameraModel& camera) {
  std::array<double, kInteriorTerms> values{camera.focal_length_px, camera.principal_point.x_px,
                                            camera.principal_point.y_px};
  const auto terms = camera.distortion.terms();
  std::copy(terms.begin(), terms.end(), values.begin() + 3);
  return values;
}

TargetField with_errors(TargetField field, double sigma_mm, std::mt19937& random) {
  if (sigma_mm <= 0.0) return field;
  std::normal_distribution<double> error(0.0, sigma_mm);
  for (auto& [id, target] : field.targets) {
    for (int k = 0; k < 3; ++k) target.p_world_mm[k] += error(random);
    target.sigma_mm = sigma_mm;
  }
  return field;
}

double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values.empty() ? 0.0 : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

ResectConfig resect_config(double noise_px) {
  ResectConfig config;
  config.noise_floor_px = 0.25 * noise_px;  // the noise is known here: the floor is for what is not
  return config;
}

double normalised_error(const CameraPose& found, const CameraPose& truth) {
  Vector6d error;
  error.head<3>() = found.center_world_mm - truth.center_world_mm;
  const Eigen::AngleAxisd turn(found.R_cam_world * truth.R_cam_world.transpose());
  error.tail<3>() = turn.angle() * turn.axis();
  return error.dot(found.covariance.ldlt().solve(error));
}

// Every id of a chosen few is that of another: each takes the place of the next.
std::vector<int> swap_ids(std::vector<DetectedTarget>& seen, int count, std::mt19937& random) {
  std::shuffle(seen.begin(), seen.end(), random);
  std::vector<int> wrong;
  for (int i = 0; i < count; ++i) wrong.push_back(seen[static_cast<std::size_t>(i)].id);
  for (int i = 0; i + 1 < count; ++i)
    std::swap(seen[static_cast<std::size_t>(i)].id, seen[static_cast<std::size_t>(i + 1)].id);
  return wrong;
}

}  // namespace

MonteCarlo repeat_calibration(int repetitions, double noise_px) {
  const CameraModel camera = camera_of(kLargeScale.cameras[0]);
  const auto truth = interior(camera);
  MonteCarlo result;
  for (int i = 0; i < repetitions; ++i) {
    std::mt19937 random(static_cast<unsigned>(1000 + i));
    const TargetField field = make_field(kFieldTargets, random);
    const auto found = calibrate_once(camera, field, field, noise_px, random);
    if (!found) continue;
    const auto values = interior(found->camera);
    for (std::size_t k = 0; k < truth.size(); ++k)
      result.covered[k] += std::abs(values[k] - truth[k]) < found->ci95(static_cast<int>(k)) ? 1.0 : 0.0;
    result.rms_px += found->reprojection_rms_px;
    ++result.repetitions;
  }
  for (double& share : result.covered) share /= std::max(1, result.repetitions);
  result.rms_px /= std::max(1, result.repetitions);
  return result;
}

PoseErrors repeat_pose(int repetitions, double noise_px, int targets, int wrong_ids) {
  const CameraModel camera = camera_of(kLargeScale.cameras[0]);
  PoseErrors errors;
  std::vector<double> distances;
  for (int i = 0; i < repetitions; ++i) {
    std::mt19937 random(static_cast<unsigned>(5000 + i));
    const TargetField field = make_field(kFieldTargets, random);
    const CameraPose truth = pose_at(9000.0, 0.0, 0.0);
    auto all = see(camera, truth, field, noise_px, random);
    const auto ids = spread_targets(all, field, targets);
    std::vector<DetectedTarget> seen;
    for (const DetectedTarget& t : all)
      if (std::ranges::find(ids, t.id) != ids.end()) seen.push_back(t);
    const auto wrong = swap_ids(seen, wrong_ids, random);
    const auto found = resect(camera, seen, only(field, ids), resect_config(noise_px));
    if (!found) {
      ++errors.wrong_pose;
      continue;
    }
    const double distance = (found->pose.center_world_mm - truth.center_world_mm).norm();
    distances.push_back(distance);
    if (distance > 3.0) ++errors.wrong_pose;
    errors.interval_mm += 1.96 * std::sqrt(found->pose.covariance.diagonal().head<3>().sum()) / repetitions;
    errors.chi2 += normalised_error(found->pose, truth) / repetitions;
    for (const ResectedTarget& t : found->targets) {
      const bool is_wrong = std::ranges::find(wrong, t.id) != wrong.end();
      if (is_wrong && t.used) ++errors.wrong_not_listed;
      if (!is_wrong && !t.used) ++errors.right_listed;
    }
  }
  errors.median_mm = quantile(distances, 0.5);
  errors.p95_mm = quantile(distances, 0.95);
  return errors;
}

CheckErrors repeat_check(int repetitions, double noise_px, double field_sigma_mm) {
  std::vector<double> e3d, mean, largest, rms;
  CheckErrors result;
  for (int i = 0; i < repetitions; ++i) {
    std::mt19937 random(static_cast<unsigned>(9000 + i));
    std::array<PosedView, 2> views;
    const TargetField truth = make_field(kFieldTargets, random);
    const TargetField used = with_errors(truth, field_sigma_mm, random);
    std::vector<int> fixed;
    bool all_well = true;
    for (std::size_t c = 0; c < 2; ++c) {
      const CameraModel camera = camera_of(kLargeScale.cameras[c]);
      const auto calibration = calibrate_once(camera, truth, used, noise_px, random);
      const CameraPose pose = pose_at(9000.0, (c == 0 ? -0.5 : 0.5) * kLargeScale.base_mm, 0.0);
      views[c].targets = see(camera, pose, truth, noise_px, random);
      const auto ids = spread_targets(views[c].targets, used, kPoseTargets);
      if (!calibration) {
        all_well = false;
        break;
      }
      views[c].camera = calibration->camera;
      const auto found = resect(views[c].camera, views[c].targets, only(used, ids), resect_config(noise_px));
      if (!found) {
        all_well = false;
        break;
      }
      views[c].pose = found->pose;
      fixed.insert(fixed.end(), ids.begin(), ids.end());
    }
    if (!all_well) continue;
    const CheckErrors errors = check_targets(views, used, fixed);
    result.targets += errors.targets;
    result.angle_min_deg = errors.angle_min_deg;
    result.angle_max_deg = errors.angle_max_deg;
    e3d.push_back(errors.e3d_rms_mm);
    mean.push_back(errors.e2d_mean_mm);
    largest.push_back(errors.e2d_max_mm);
    rms.push_back(errors.e2d_rms_mm);
  }
  result.e3d_rms_mm = quantile(e3d, 0.5);
  result.e2d_mean_mm = quantile(mean, 0.5);
  result.e2d_max_mm = quantile(largest, 0.5);
  result.e2d_rms_mm = quantile(rms, 0.5);
  return result;
}

}  // namespace imprint::paper
