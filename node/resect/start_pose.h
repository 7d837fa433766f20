#pragma once

#include <optional>
#include <vector>

#include "lib/camera/camera_pose.h"

namespace imprint {

/// One target seen and known: the ray through (x, y, 1) in camera axes points at `p_world_mm`.
struct Correspondence {
  Eigen::Vector2d direction_cam = Eigen::Vector2d::Zero();
  Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();
};

/// The pose on which most correspondences agree to within `tolerance` (in units of the image plane at
/// z = 1), from triples of them; correspondences with wrong ids are outvoted. Deterministic; no covariance.
/// Nothing when fewer than `min_agreeing` agree on any pose.
/// Minimal solutions instead of the direct linear transformation of [B] 2.4: they need no six points out
/// of one plane, and one wrong id spoils only the triples that hold it.
std::optional<CameraPose> start_pose(const std::vector<Correspondence>& correspondences, double tolerance,
                                     int min_agreeing);

}  // namespace imprint
