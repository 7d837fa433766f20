#pragma once

#include <array>
#include <map>
#include <vector>

#include "lib/camera/camera_model.h"
#include "lib/camera/camera_pose.h"
#include "lib/targets/target_field.h"
#include "node/detect/detect_targets.h"

namespace imprint::paper {

/// A calibrated camera in its place and what it sees.
struct PosedView {
  CameraModel camera;
  CameraPose pose;
  std::vector<DetectedTarget> targets;
};

/// [B] table 5 for one pair of views.
struct CheckErrors {
  int targets = 0;
  double e3d_rms_mm = 0.0;
  double e2d_mean_mm = 0.0, e2d_max_mm = 0.0, e2d_rms_mm = 0.0;
  double angle_min_deg = 0.0, angle_max_deg = 0.0;
};

/// Intersects the rays to every target that both views show and `field` knows, but for `fixed`, and compares with the
/// field; the 2D error is that of a single ray across the depth direction, [B] 3.3.
CheckErrors check_targets(const std::array<PosedView, 2>& views, const TargetField& field,
                          const std::vector<int>& fixed);

/// The `count` targets that spread widest over the image: from the corners inwards, each the farthest from those taken.
std::vector<int> spread_targets(const std::vector<DetectedTarget>& targets, const TargetField& field, int count);

TargetField only(const TargetField& field, const std::vector<int>& ids);

}  // namespace imprint::paper
