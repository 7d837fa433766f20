#pragma once

#include <span>

#include "fusion/triangulate/axis_curve.h"
#include "fusion/triangulate/camera_view.h"
#include "lib/result/result.h"

namespace imprint {

/// Rays of several axis imprints that meet in one point of the axis.
struct AxisGroup {
  struct Member {
    std::size_t view = 0;  ///< index into the views
    double station = 0.0;  ///< of the ray along that view's curves; may fall between two
  };
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  std::vector<Member> members;
};

/// The axis by the closest rays of the axis imprints ([D] equations 1 to 3): for each ray of the camera that sees most,
/// the closest ray of every other camera (between two stations where it falls between them), and the point nearest to
/// all of them by least squares. Groups whose rays pass each other further apart than `max_distance_mm` ([D] equation
/// 2) are left out.
std::vector<AxisGroup> group_axis_rays(std::span<const CameraView> views, double max_distance_mm);

/// The points of `group_axis_rays`.
std::vector<Eigen::Vector3d> triangulate_axis_points(std::span<const CameraView> views, double max_distance_mm);

/// The straight line through axis points, along `axis_direction`, with the range they span. Robust against
/// groups of rays that do not belong together. Fails when there are fewer than 10 points or they form no line.
Result<AxisCurve> line_through(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& axis_direction,
                               int samples);

}  // namespace imprint
