#pragma once

#include <vector>

#include "lib/camera/camera_model.h"
#include "lib/camera/camera_pose.h"
#include "lib/result/result.h"
#include "lib/targets/target_field.h"
#include "node/detect/detect_targets.h"

namespace imprint {

struct ResectConfig {
  double max_residual_px = 3.0;   // a target off by more than this is never used; ours
  double robust_scale_px = 0.1;   // Cauchy scale of the reprojection residual; ours
  int min_targets = 4;            // 6 unknowns need 3 points; one more lets a wrong one show; ours

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

/// The camera's pose with its covariance, from one image: start values by direct linear transformation or
/// a minimal solution, then trust-region on the robust reprojection error, [B] 2.4 and equation 1.
/// Fails (job_failed) with fewer than `min_targets` usable targets, naming those it has.
Result<Resection> resect(const CameraModel& camera, const std::vector<DetectedTarget>& detected,
                         const TargetField& field, const ResectConfig& config);

}  // namespace imprint
