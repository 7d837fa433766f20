#pragma once

#include <array>
#include <vector>

#include "lib/camera/camera_model.h"
#include "lib/camera/camera_pose.h"
#include "lib/result/result.h"
#include "simulation/body_pose.h"
#include "simulation/forging_body.h"

namespace imprint {

/// The outline of the body as one camera shows it: observed points without haze, blur or pixels.
struct BodyOutline {
  std::vector<ObservedPoint> upper;  ///< rim with the smaller y, from the first end to the second
  std::vector<ObservedPoint> lower;
  std::vector<ObservedPoint> first_end;   ///< arc of the first end's rim from lower to upper rim
  std::vector<ObservedPoint> second_end;  ///< arc of the second end's rim from upper to lower rim

  /// All four as one closed polygon.
  [[nodiscard]] std::vector<ObservedPoint> polygon() const;
};

/// The normal directions phi (rad) at which the section x_mm of the body is touched by rays from the camera's centre
/// (body frame): first the one a quarter turn clockwise (from y to z negative) of the line of sight, then the other.
/// Solves F(phi) = (P - C) . N = 0 for the contour of the solid, whose slope along x it respects.
std::array<double, 2> contour_directions(const SectionShape& section, double x_mm,
                                         const Eigen::Vector3d& center_body_mm);

/// Vertices `spacing_px` apart along the rims and closer along the ends. The true outline leaves the chords by less
/// than spacing_px^2 / (8 x radius of curvature). Fails (job_failed) when a step hides a part of the rim behind it
/// or a camera looks along the axis.
Result<BodyOutline> body_outline(const ForgingBody& body, const BodyPose& body_pose, const CameraModel& camera,
                                 const CameraPose& pose, double spacing_px);

}  // namespace imprint
