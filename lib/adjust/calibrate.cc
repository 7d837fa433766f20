#include "lib/adjust/calibrate.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <fmt/ranges.h>

#include "lib/adjust/calibration_review.h"
#include "lib/adjust/collinearity_error.h"
#include "lib/adjust/own_focal_length.h"
#include "lib/adjust/variance_components.h"
#include "lib/geometry/median.h"
#include "lib/geometry/rotation.h"

namespace imprint {
namespace {

struct FieldError {
  Eigen::Vector3d stated_mm;
  double sigma_mm;

  template <class T>
  bool operator()(const T* point, T* residual) const {
    for (int k = 0; k < 3; ++k) residual[k] = (point[k] - stated_mm[k]) / sigma_mm;
    return true;
  }
};

struct ImageFocalLength : OwnFocalLength {
  std::size_t image = 0;
};

struct Observation {
  std::size_t image = 0;
  PointObservation point;
  double sigma_px = 0.0;
  ObservedPoint eccentricity_px{};  // of the dot's image, where its disc is known
  bool used = true;
  Eigen::Vector2d residual_px = Eigen::Vector2d::Zero();

  [[nodiscard]] CollinearityError error(const CameraModel& camera, double sigma) const {
    return {{point.at.x_px - eccentricity_px.x_px, point.at.y_px - eccentricity_px.y_px},
            sigma,
            camera.normalizer_px(),
            camera.distortion.r0};
  }
  [[nodiscard]] CollinearityError error(const CameraModel& camera) const { return error(camera, sigma_px); }
};

class Adjustment {
 public:
  Adjustment(const CameraModel& start, const std::vector<CalibrationImage>& images, const TargetField& field,
             const DotDiscs& dots, const CalibrateConfig& config)
      : start_(start), images_(images), field_(field), dots_(dots), config_(config) {
    interior_ = {start.focal_length_px, start.principal_point.x_px, start.principal_point.y_px};
    for (const CalibrationImage& image : images) {
      std::array<double, 3> turn{}, center{};
      ceres::RotationMatrixToAngleAxis(image.start.R_cam_world.data(), turn.data());  // both by columns
      std::copy_n(image.start.center_world_mm.data(), 3, center.data());
      turns_.push_back(turn);
      centers_.push_back(center);
      for (const PointObservation& point : image.points) {
        const auto target = field.targets.find(point.id);
        if (target == field.targets.end()) {
          unknown_.push_back({centers_.size() - 1, point.id});
          continue;
        }
        std::copy_n(target->second.p_world_mm.data(), 3, points_[point.id].data());
        observations_.push_back({.image = centers_.size() - 1,
                                 .point = point,
                                 .sigma_px = std::hypot(point.sigma_px, config.noise_floor_px)});
      }
    }
  }

  Result<Calibration> run() {
    // Robust first; then least squares over what fits, until it is the same targets.
    if (auto solved = solve(true); !solved) return pass_on(solved.error());
    if (auto one = check_one_camera(); !one) return pass_on(one.error());
    correct_eccentricity();
    for (int round = 0; round < 6 && choose(); ++round)
      if (auto solved = solve(false); !solved) return pass_on(solved.error());
    if (auto plausible = check(); !plausible) return pass_on(plausible.error());
    if (auto enough = check_redundancy(); !enough) return pass_on(enough.error());
    correct_eccentricity();
    weigh();
    if (auto solved = solve(false); !solved) return pass_on(solved.error());
    return describe();
  }

 private:
  Result<void> solve(bool robust) {
    ceres::Problem::Options options;
    problem_.emplace(options);
    for (Observation& o : observations_) {
      if (!robust && !o.used) continue;
      auto* cost = new ceres::AutoDiffCostFunction<CollinearityError, 2, kInteriorTerms, 3, 3, 3>(
          new CollinearityError(o.error(start_)));
      // Far below what a wrong id does and well above what a start value is off.
      auto* loss = robust ? new ceres::CauchyLoss(std::max(3.0, 0.3 / o.sigma_px)) : nullptr;
      problem_->AddResidualBlock(cost, loss, interior_.data(), turns_[o.image].data(), centers_[o.image].data(),
                                 points_[o.point.id].data());
    }
    for (auto& [id, point] : points_) {
      if (!problem_->HasParameterBlock(point.data())) continue;
      const FieldTarget& target = field_.targets.at(id);
      if (const double sigma = std::hypot(target.sigma_mm.value_or(0.0), components_.target_sigma_mm); sigma > 0.0) {
        problem_->AddResidualBlock(
            new ceres::AutoDiffCostFunction<FieldError, 3, 3>(new FieldError{target.p_world_mm, sigma}), nullptr,
            point.data());
      } else {
        problem_->SetParameterBlockConstant(point.data());
      }
    }
    ceres::Solver::Options how;
    how.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    how.max_num_iterations = 200;
    how.function_tolerance = 1e-14;
    how.parameter_tolerance = 1e-14;
    how.gradient_tolerance = 1e-14;
    how.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(how, &*problem_, &summary);
    if (!summary.IsSolutionUsable()) return job_failed("calibration: the adjustment came to no solution");
    find_residuals();
    return {};
  }

  void find_residuals() {
    for (Observation& o : observations_) {
      const CollinearityError error = o.error(start_, 1.0);
      if (!error(interior_.data(), turns_[o.image].data(), centers_[o.image].data(), points_[o.point.id].data(),
                 o.residual_px.data()))
        o.residual_px.setConstant(1e6);  // behind the camera
    }
  }

  CameraPose pose_of(std::size_t image) const {
    CameraPose pose;
    pose.R_cam_world = rotation_from_vector(Eigen::Vector3d::Map(turns_[image].data()));
    pose.center_world_mm = Eigen::Vector3d::Map(centers_[image].data());
    return pose;
  }

  CameraModel camera() const {
    CameraModel camera = start_;
    camera.focal_length_px = interior_[0];
    camera.principal_point = {interior_[1], interior_[2]};
    std::copy_n(interior_.data() + 3, 3, camera.distortion.radial.begin());
    std::copy_n(interior_.data() + 6, 2, camera.distortion.tangential.begin());
    std::copy_n(interior_.data() + 8, 2, camera.distortion.affine.begin());
    return camera;
  }

  // The centre of a dot's image is not the image of its centre.
  void correct_eccentricity() {
    const CameraModel found = camera();
    for (Observation& o : observations_) {
      const auto disc = dots_.find(o.point.id);
      if (disc == dots_.end()) continue;
      const CameraPose pose = pose_of(o.image);
      const Eigen::Vector3d p_world = Eigen::Vector3d::Map(points_[o.point.id].data());
      if (pose.cam_from_world(p_world).z() > 2.0 * disc->second.radius)
        o.eccentricity_px = eccentricity_px(found, pose, p_world, disc->second);
    }
  }

  // Gives noise and targets the variances that the residuals show.
  void weigh() {
    const auto shared = static_cast<Eigen::Index>(kInteriorTerms + 6 * images_.size());
    std::vector<LinearSight> sights;
    std::map<int, double> stated_sigma_mm;
    for (Observation& o : observations_) {
      if (!o.used) continue;
      const FieldTarget& target = field_.targets.at(o.point.id);
      stated_sigma_mm[o.point.id] = target.sigma_mm.value_or(0.0);
      const ceres::AutoDiffCostFunction<CollinearityError, 2, kInteriorTerms, 3, 3, 3> cost(
          new CollinearityError(o.error(start_)));
      LinearSight sight{o.point.id, {}, Eigen::Matrix<double, 2, Eigen::Dynamic>::Zero(2, shared), {}};
      Eigen::Matrix<double, 2, kInteriorTerms, Eigen::RowMajor> by_interior;
      Eigen::Matrix<double, 2, 3, Eigen::RowMajor> by_turn, by_center, by_target;
      const std::array<const double*, 4> at{interior_.data(), turns_[o.image].data(), centers_[o.image].data(),
                                            target.p_world_mm.data()};
      std::array<double*, 4> slopes{by_interior.data(), by_turn.data(), by_center.data(), by_target.data()};
      if (!cost.Evaluate(at.data(), sight.residual.data(), slopes.data())) continue;
      const auto first = static_cast<Eigen::Index>(kInteriorTerms + 6 * o.image);
      sight.by_shared.leftCols<kInteriorTerms>() = by_interior;
      sight.by_shared.middleCols<3>(first) = by_turn;
      sight.by_shared.middleCols<3>(first + 3) = by_center;
      sight.by_target = by_target;
      sights.push_back(std::move(sight));
    }
    components_ = find_variance_components(sights, stated_sigma_mm);
    for (Observation& o : observations_) o.sigma_px *= components_.noise;
  }

  // Which targets fit; whether that has changed.
  bool choose() {
    std::vector<double> sizes;
    for (const Observation& o : observations_) {
      if (!o.used) continue;
      for (const double r : {o.residual_px.x(), o.residual_px.y()}) sizes.push_back(std::abs(r) / o.sigma_px);
    }
    if (sizes.empty()) return false;
    const double sigmas = 1.4826 * median(sizes) * config_.reject_sigmas;
    bool changed = !chosen_;
    chosen_ = true;
    for (Observation& o : observations_) {
      const bool used = o.residual_px.norm() < std::max(config_.reject_floor_px, sigmas * o.sigma_px);
      changed |= used != o.used;
      o.used = used;
    }
    return changed;
  }

  // Two lenses, or two settings of one, in the same set: each image's own focal length tells.
  Result<void> check_one_camera() {
    std::vector<ImageFocalLength> own;
    for (std::size_t i = 0; i < images_.size(); ++i) {
      std::vector<CentreSeen> centres;
      for (const Observation& o : observations_)
        if (o.image == i) centres.push_back({o.error(start_), points_[o.point.id]});
      if (const auto found = own_focal_length(interior_, turns_[i], centers_[i], centres)) own.push_back({*found, i});
    }
    if (own.size() < 2) return {};
    std::ranges::sort(own, {}, &ImageFocalLength::value_px);
    std::size_t split = 0;
    double widest = 0.0;
    for (std::size_t i = 0; i + 1 < own.size(); ++i) {
      const double gap = own[i + 1].value_px - own[i].value_px;
      const double sigma = std::hypot(own[i].sigma_px, own[i + 1].sigma_px);
      if (gap < config_.mixed_focal_sigmas * sigma || gap < config_.mixed_focal_share * own[i].value_px) continue;
      if (gap > widest) widest = gap, split = i + 1;
    }
    if (widest == 0.0) return {};
    const auto describe_side = [&](auto begin, auto end) {
      std::vector<ImageFocalLength> side(begin, end);
      std::ranges::sort(side, {}, &ImageFocalLength::image);
      std::vector<std::string> names;
      double sum = 0.0;
      for (const ImageFocalLength& one : side) names.push_back(images_[one.image].name), sum += one.value_px;
      return fmt::format("{:.1f} px ({})", sum / static_cast<double>(side.size()), fmt::join(names, ", "));
    };
    const auto middle = own.begin() + static_cast<std::ptrdiff_t>(split);
    return invalid_input(
        "calibration: images of two cameras or focus settings are mixed: some show a focal length of {}, others of "
        "{}; calibrate them apart",
        describe_side(own.begin(), middle), describe_side(middle, own.end()));
  }

  Result<void> check() const {
    std::vector<int> used(images_.size(), 0), known(images_.size(), 0);
    for (const Observation& o : observations_) ++known[o.image], used[o.image] += o.used ? 1 : 0;
    for (std::size_t i = 0; i < images_.size(); ++i) {
      if (used[i] >= config_.min_targets && used[i] >= (1.0 - config_.max_rejected_share) * known[i]) continue;
      return invalid_input(
          "{}: only {} of its {} targets fit the camera that the other images show; is it from another camera or "
          "focus, or has the field changed? Leave it out or calibrate it alone",
          images_[i].name, used[i], known[i]);
    }
    const double found = interior_[0] / start_.focal_length_px;
    if (std::abs(found - 1.0) > config_.max_focal_difference)
      return invalid_input(
          "calibration: found a focal length of {:.1f} px, but {:.1f} px were stated; check --pixel-pitch-um, "
          "--focal-length-mm and the unit of the field (mm)",
          interior_[0], start_.focal_length_px);
    return {};
  }

  Result<void> check_redundancy() const {
    const auto used = static_cast<int>(std::ranges::count_if(observations_, &Observation::used));
    if (2 * used - kInteriorTerms - 6 * static_cast<int>(images_.size()) >= 1) return {};
    return invalid_input("calibration: {} targets in {} images do not determine a camera; take more images", used,
                         images_.size());
  }

  Result<Calibration> describe() {
    Calibration result;
    result.camera = camera();
    result.target_sigma_mm = components_.target_sigma_mm;
    double squares = 0.0;
    for (const Observation& o : observations_) {
      result.residuals.push_back({o.image, o.point.id, o.point.at, o.residual_px.x(), o.residual_px.y(), o.used});
      if (!o.used) continue;
      squares += o.residual_px.squaredNorm();
      ++result.observations;
    }
    result.reprojection_rms_px = std::sqrt(squares / result.observations);
    for (std::size_t i = 0; i < images_.size(); ++i) result.poses.push_back(pose_of(i));
    ceres::Covariance::Options how;
    how.algorithm_type = ceres::SPARSE_QR;
    ceres::Covariance covariance(how);
    Eigen::Matrix<double, kInteriorTerms, kInteriorTerms, Eigen::RowMajor> block;
    const std::vector<std::pair<const double*, const double*>> wanted{{interior_.data(), interior_.data()}};
    if (!covariance.Compute(wanted, &*problem_) ||
        !covariance.GetCovarianceBlock(interior_.data(), interior_.data(), block.data()))
      return invalid_input(
          "calibration: the images leave {} open; take some with the camera rolled by 90 deg and the "
          "field seen aslant",
          "the camera's constants");
    result.covariance = block;  // the variances are those that the residuals show
    result.unknown = unknown_;
    result.warnings = separation_warnings(result, images_, field_, config_);
    return result;
  }

  CameraModel start_;
  const std::vector<CalibrationImage>& images_;
  const TargetField& field_;
  const DotDiscs& dots_;
  CalibrateConfig config_;
  VarianceComponents components_;
  std::array<double, kInteriorTerms> interior_{};
  std::vector<std::array<double, 3>> turns_, centers_;
  std::map<int, std::array<double, 3>> points_;
  std::vector<Observation> observations_;
  std::vector<UnknownTarget> unknown_;
  std::optional<ceres::Problem> problem_;
  bool chosen_ = false;
};

}  // namespace

Result<void> CalibrateConfig::validate() const {
  if (!(noise_floor_px > 0.0) || !(reject_sigmas > 0.0) || !(reject_floor_px >= 0.0))
    return invalid_input("calibrate: noise_floor_px and reject_sigmas above 0 expected, reject_floor_px at least 0");
  if (min_targets < 4) return invalid_input("calibrate.min_targets: at least 4 expected, found {}", min_targets);
  if (!(max_rejected_share > 0.0 && max_rejected_share < 1.0) || !(max_focal_difference > 0.0))
    return invalid_input("calibrate: shares above 0 (and max_rejected_share below 1) expected");
  return {};
}

Result<Calibration> calibrate_camera(const CameraModel& start, const std::vector<CalibrationImage>& images,
                                     const TargetField& field, const CalibrateConfig& config, const DotDiscs& dots) {
  if (images.empty()) return invalid_input("calibration: expected images, found none");
  for (const CalibrationImage& image : images) {
    const auto known = std::count_if(image.points.begin(), image.points.end(),
                                     [&](const PointObservation& p) { return field.targets.count(p.id) > 0; });
    if (known < config.min_targets)
      return job_failed("{}: shows {} targets of the field, at least {} are needed; leave it out", image.name, known,
                        config.min_targets);
  }
  constexpr double kOnALine = 0.02;
  if (field_extents(images, field)[1] < kOnALine)
    return invalid_input("calibration: the targets seen stand on one line; spread them over the image and in depth");
  return Adjustment(start, images, field, dots, config).run();
}

}  // namespace imprint
