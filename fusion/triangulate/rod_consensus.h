#pragma once

#include <span>
#include <vector>

#include "fusion/triangulate/axis_curve.h"
#include "fusion/triangulate/camera_view.h"
#include "fusion/triangulate/rim_tangents.h"
#include "lib/rig/rig.h"

namespace imprint {

/// The rod on which most rim points agree: a smooth axis and a radius that is even but for a few steps.
struct RodConsensus {
  AxisCurve axis;
  std::vector<double> radius_mm;  ///< one a sample of `axis`
  double scatter_mm = 0.0;        ///< robust sigma of the rim points that agree, out-of-round included

  /// How far a rim point lies outside (+) or inside (-) of the rod. Next to a step all radii from the one to the other
  /// are on it.
  [[nodiscard]] double deviation_mm(const RimContact& contact) const;
  /// Beyond this deviation a rim point belongs to something else: scale, a beam, the end circle.
  [[nodiscard]] double tolerance_mm() const;
  [[nodiscard]] double median_radius_mm(double from_x_mm, double to_x_mm) const;
};

/// From a rough straight or bent axis (a tenth of the radius off) to the rod, over the range of `start`: in turn the
/// radius along the axis by dynamic programming over all rim points, each of which counts little once it lies far off
/// (Geman and McClure's loss), and the axis as a polynomial whose degree grows while that loss gets sharper. Stretches
/// where most rims are wrong are outvoted by those beside them, as long as the wrong ones are ragged.
RodConsensus agree_on_rod(std::span<const CameraView> views, AxisCurve start, const ForgingSpec& forging);

}  // namespace imprint
