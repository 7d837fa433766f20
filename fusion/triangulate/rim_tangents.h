#pragma once

#include <span>
#include <vector>

#include "fusion/triangulate/axis_curve.h"
#include "fusion/triangulate/camera_view.h"

namespace imprint {

/// One rim point of one camera as a tangent of the bar about an axis curve.
struct RimTangent {
  std::size_t view = 0;  ///< index into the views
  bool upper = false;
  Eigen::Vector3d ray = Eigen::Vector3d::UnitZ();
  double weight = 0.0;
  double mm_per_px = 0.0;  ///< scale across the ray at the contact
  RimContact contact;
};

/// All trusted rim points as tangents of the bar about `axis`.
std::vector<RimTangent> rim_tangents(std::span<const CameraView> views, const AxisCurve& axis);

}  // namespace imprint
