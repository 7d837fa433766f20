#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "fusion/combine/alignment.h"
#include "fusion/thesis/thesis_config.h"
#include "fusion/triangulate/camera_view.h"
#include "lib/result/result.h"
#include "lib/rig/rig.h"

namespace imprint {

/// One rim of one camera as a curve in space, beside the axis.
struct Silhouette {
  std::size_t view = 0;  ///< index into the views
  bool upper = false;
  Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();  ///< of the camera
  std::vector<Eigen::Vector3d> points_mm;               ///< ascending along the axis; where the rim was trusted
};

/// The output of one observation, [D] 2.1.3 "Multi-camera solution": axis and silhouettes as discrete points in space.
struct SpaceCurves {
  std::vector<Eigen::Vector3d> axis_mm;  ///< at equal steps along the chord
  std::vector<Silhouette> silhouettes;

  [[nodiscard]] double step_mm() const;  ///< between two axis points
  void move(const Placement& placement);
};

/// From the views of one observation, in the world: the axis from the closest rays of the axis imprints (the middles of
/// the rims), each silhouette brought to the axis's distance by the image scale ([D] equations 1 to 4), smoothed.
/// Fails (job_failed) when the axis imprints meet in fewer than 10 points.
Result<SpaceCurves> space_curves(std::span<const CameraView> views, const ForgingSpec& forging,
                                 const ThesisConfig& config);

}  // namespace imprint
