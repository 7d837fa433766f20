#include "lib/adjust/calibration_review.h"

#include <algorithm>
#include <map>
#include <numbers>

#include <fmt/core.h>
#include <Eigen/Geometry>
#include <Eigen/SVD>

namespace imprint {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// By how much the images differ: in roll about the optical axis, and in direction of view.
struct ViewSpread {
  double roll_deg = 0.0;
  double direction_deg = 0.0;
};

ViewSpread view_spread(const std::vector<CameraPose>& poses) {
  ViewSpread spread;
  for (const CameraPose& a : poses) {
    for (const CameraPose& b : poses) {
      // Swing and twist: what of the turn from a to b is about the optical axis.
      const Eigen::Quaterniond turn(b.R_cam_world * a.R_cam_world.transpose());
      const double roll = 2.0 * std::atan2(std::abs(turn.z()), std::abs(turn.w()));
      const double cosine = a.R_cam_world.row(2).dot(b.R_cam_world.row(2));
      spread.roll_deg = std::max(spread.roll_deg, roll / kDegree);
      spread.direction_deg = std::max(spread.direction_deg, std::acos(std::clamp(cosine, -1.0, 1.0)) / kDegree);
    }
  }
  return spread;
}

std::vector<std::string> correlations(const InteriorMatrix& covariance, double limit) {
  std::vector<std::string> lines;
  for (int i = 0; i < kInteriorTerms; ++i) {
    for (int j = 0; j < i; ++j) {
      // The radial terms are powers of the same radius: they always go together.
      if (i >= 3 && i < 6 && j >= 3) continue;
      const double c = covariance(i, j) / std::sqrt(covariance(i, i) * covariance(j, j));
      if (std::abs(c) < limit) continue;
      lines.push_back(fmt::format(
          "{} and {} cannot be told apart (correlation {:+.3f}); add images rolled by 90 deg and views aslant",
          kInteriorNames[static_cast<std::size_t>(j)], kInteriorNames[static_cast<std::size_t>(i)], c));
    }
  }
  return lines;
}

}  // namespace

Eigen::Vector3d field_extents(const std::vector<CalibrationImage>& images, const TargetField& field) {
  std::map<int, Eigen::Vector3d> seen;
  for (const CalibrationImage& image : images)
    for (const PointObservation& point : image.points)
      if (const auto it = field.targets.find(point.id); it != field.targets.end())
        seen[it->first] = it->second.p_world_mm;
  if (seen.size() < 3) return {1.0, 0.0, 0.0};
  Eigen::MatrixXd points(static_cast<Eigen::Index>(seen.size()), 3);
  Eigen::Index row = 0;
  for (const auto& [id, p] : seen) points.row(row++) = p.transpose();
  points.rowwise() -= points.colwise().mean().eval();
  const Eigen::Vector3d extents = Eigen::JacobiSVD<Eigen::MatrixXd>(points).singularValues();
  if (!(extents[0] > 0.0)) return {1.0, 0.0, 0.0};
  return extents / extents[0];
}

std::vector<std::string> separation_warnings(const Calibration& calibration,
                                             const std::vector<CalibrationImage>& images, const TargetField& field,
                                             const CalibrateConfig& config) {
  std::vector<std::string> lines = correlations(calibration.covariance, config.warn_correlation);
  const ViewSpread spread = view_spread(calibration.poses);
  const bool flat = field_extents(images, field)[2] < config.flat_share;
  const bool one_side = spread.direction_deg < config.min_turn_deg;
  if (flat && one_side)
    lines.push_back(fmt::format(
        "the field is flat and seen from one side (directions differ by {:.0f} deg): focal length and distance are "
        "hardly told apart; add views aslant by 30 deg or more, or targets in depth",
        spread.direction_deg));
  if (one_side && spread.roll_deg < config.min_turn_deg)
    lines.push_back(fmt::format(
        "the camera was rolled by {:.0f} deg only: errors of the field and of the lens are hardly told apart; add "
        "images rolled by 90 deg",
        spread.roll_deg));
  if (const double half_width = calibration.ci95(0);
      half_width > config.warn_focal_share * calibration.camera.focal_length_px)
    lines.push_back(
        fmt::format("focal_length_px is known to no better than +-{:.1f} px; add views aslant", half_width));
  const double wide_px = config.warn_principal_point_share * calibration.camera.normalizer_px();
  for (const int axis : {1, 2}) {
    if (calibration.ci95(axis) > wide_px)
      lines.push_back(fmt::format("{} is known to no better than +-{:.1f} px; add images rolled by 90 deg",
                                  kInteriorNames[static_cast<std::size_t>(axis)], calibration.ci95(axis)));
  }
  return lines;
}

std::string rejection_reason(const Calibration& calibration, const CalibrationResidual& residual) {
  int seen = 0, fitting = 0;
  for (const CalibrationResidual& r : calibration.residuals) {
    if (r.id != residual.id) continue;
    ++seen;
    fitting += r.used ? 1 : 0;
  }
  const double off_px = std::hypot(residual.dx_px, residual.dy_px);
  constexpr double kAnotherTarget_px = 10.0;
  if (seen > 1 && fitting == 0)
    return fmt::format("{:.2f} px off, and off in all {} images: it has moved, or its coordinates are wrong", off_px,
                       seen);
  if (off_px > kAnotherTarget_px) return fmt::format("{:.2f} px off: wrong id", off_px);
  return fmt::format("{:.2f} px off: dirty, partly covered, or a wrong id", off_px);
}

}  // namespace imprint
