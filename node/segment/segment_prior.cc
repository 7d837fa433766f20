#include "node/segment/segment_prior.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace imprint {
namespace {

// Median of the distances along the optical axis of the targets in front of the camera; 0 when there are none.
double field_depth_mm(const CameraPose& pose, const TargetField& field) {
  std::vector<double> depths;
  for (const auto& [id, target] : field.targets) {
    const double z = pose.cam_from_world(target.p_world_mm).z();
    if (z > 0) depths.push_back(z);
  }
  if (depths.empty()) return 0.0;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

}  // namespace

Result<SegmentPrior> make_segment_prior(const CameraModel& camera, const CameraPose& pose, const ForgingSpec& forging,
                                        const TargetField& field) {
  constexpr double kNearest = 0.6, kFarthest = 1.5;  // the forging stands among the targets, not in their middle
  const double depth_mm = field_depth_mm(pose, field);
  if (!(depth_mm > 0)) return job_failed("{}: no target of the field lies in front of the camera", camera.id);

  // On the optical axis among the targets: in view whatever the field's shape is.
  const Eigen::Vector3d middle_cam_mm(0, 0, depth_mm);
  const Eigen::Vector3d axis_cam = pose.R_cam_world * forging.axis_direction_world;
  const double across = std::hypot(axis_cam.x(), axis_cam.y());
  if (across < 0.17)
    return job_failed(
        "{}: the camera looks along the forging's axis ({:.0f} deg off it); a silhouette needs at least 10 deg",
        camera.id, std::asin(std::min(across, 1.0)) * 57.2958);
  const double half_mm = 0.05 * depth_mm;
  const ObservedPoint a = project(camera, middle_cam_mm - half_mm * axis_cam);
  const ObservedPoint b = project(camera, middle_cam_mm + half_mm * axis_cam);
  const double length = std::hypot(b.x_px - a.x_px, b.y_px - a.y_px);

  // To the right, or down where it is upright, so that the upper rim is the upper one of the image.
  const double dx = b.x_px - a.x_px, dy = b.y_px - a.y_px;
  const double sign = std::abs(dx) > 1e-6 * length ? std::copysign(1.0, dx) : std::copysign(1.0, dy);
  SegmentPrior prior;
  prior.direction_x = sign * dx / length;
  prior.direction_y = sign * dy / length;
  prior.diameter_min_px = camera.focal_length_px * forging.diameter_min_mm / (kFarthest * depth_mm);
  prior.diameter_max_px = camera.focal_length_px * forging.diameter_max_mm / (kNearest * depth_mm);
  prior.likely_min_px = camera.focal_length_px * forging.diameter_min_mm / depth_mm;
  prior.likely_max_px = camera.focal_length_px * forging.diameter_max_mm / depth_mm;
  prior.polarity = forging.polarity;
  return prior;
}

}  // namespace imprint
