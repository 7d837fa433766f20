#pragma once

#include <span>
#include <string>
#include <vector>

#include "fusion/triangulate/axis_curve.h"
#include "fusion/triangulate/camera_view.h"
#include "fusion/triangulate/rod_consensus.h"
#include "fusion/triangulate/triangulate_config.h"
#include "lib/result/result.h"
#include "lib/rig/rig.h"

namespace imprint {

/// The cameras of one observation that agree with each other, and the rod they see.
struct AgreeingViews {
  std::vector<CameraView> views;
  RodConsensus rod;
  std::vector<std::pair<int, std::string>> excluded;  ///< CameraView::camera, why
  double disagreement_mm = 0.0;  ///< left among the views because it cannot be told which one is wrong
};

/// Leaves out cameras that contradict the others: by the widths they see, by where they see the axis, and - where
/// three cameras cannot settle it so - by where they see the ends. Fails (job_failed) with fewer than two cameras, or
/// when their views are nearer to parallel than `min_view_angle_deg`.
Result<AgreeingViews> agreeing_views(std::vector<CameraView> views, std::span<const std::string> ids,
                                     const ForgingSpec& forging, const TriangulateConfig& config);

/// x along `axis` at which a reading of the outline's end puts the end circle of a bar of this radius; nothing when
/// that ray passes beside it. `circle_point_mm` gets the point it met.
std::optional<double> end_position(const CameraView& view, const EndRay& end, const AxisCurve& axis, double radius_mm,
                                   bool last, Eigen::Vector3d* circle_point_mm = nullptr);

/// Whether the view's stations run along the axis (true) or against it (the camera stands on the other side).
bool runs_along(const CameraView& view, const AxisCurve& axis);

}  // namespace imprint
