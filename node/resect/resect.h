#pragma once

#include <vector>

#include "lib/camera/camera_model.h"
#include "lib/camera/camera_pose.h"
#include "lib/camera/dot_disc.h"
#include "lib/result/result.h"
#include "lib/targets/target_field.h"
#include "node/detect/detect_targets.h"

namespace imprint {

struct ResectConfig {
  int min_targets = 4;           // 3 points give a pose but cannot contradict it; ours
  double max_residual_px = 3.0;  // a target further off is taken for a wrong id; ours
  double noise_floor_px = 0.05;  // added to each target's sigma: air and lens residuals, [B] 3.3; ours
  double reject_sigmas = 4.0;    // a target is left out beyond this many robust standard deviations; ours

  [[nodiscard]] Result<void> validate() const;
};

struct ResectedTarget {
  int id = 0;
  double dx_px = 0.0;  ///< observed minus projected
  double dy_px = 0.0;
  bool used = false;
};

struct Resection {
  CameraPose pose;
  double reprojection_rms_px = 0.0;  ///< root mean square of the residual's length over the used targets
  std::vector<ResectedTarget> targets;
  std::vector<int> unknown_ids;  ///< detected, but not in the field
};

/// The camera's pose with its covariance, from one image: start by consensus of minimal solutions, then
/// Levenberg-Marquardt on the robust reprojection error, [B] 2.4 and equation 1. The covariance is that of
/// the adjustment, scaled up (never down) by the residuals found.
/// `dots`: where known, the eccentricity of a dot's image (dot_disc.h) is taken out, residuals included.
/// Fails (job_failed) with fewer than `min_targets` usable targets, naming those it has.
Result<Resection> resect(const CameraModel& camera, const std::vector<DetectedTarget>& detected,
                         const TargetField& field, const ResectConfig& config, const DotDiscs& dots = {});

}  // namespace imprint
