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

/// A circle fitted to the tangents about one sample of an axis curve.
struct FittedCircle {
  Eigen::Vector2d shift_mm = Eigen::Vector2d::Zero();  ///< of the centre from the axis curve, y and z of its line
  double radius_mm = 0.0;
  int rims = 0;  ///< distinct rims that carry it; fewer than three: not fitted
  [[nodiscard]] bool fitted() const { return rims >= 3; }
};

/// Centre and radius at every sample of `axis` by robust weighted least squares of n . c + r = offset, the support
/// function of a circle, over the tangents that touch within one and a half samples.
std::vector<FittedCircle> fit_circles(const AxisCurve& axis, std::span<const RimTangent> tangents);

/// `axis` moved by the circles' shifts, smoothed by a Savitzky-Golay window of `window` samples.
AxisCurve moved_axis(const AxisCurve& axis, std::span<const FittedCircle> circles, int window);

}  // namespace imprint
