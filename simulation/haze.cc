#include "simulation/haze.h"

#include <algorithm>
#include <cmath>

#include "simulation/random.h"

namespace imprint {
namespace {

constexpr double coarse_share = 0.8, fine_share = 0.6;  // squares add to 1
constexpr double far_strength = 0.4, plume_strength = 0.9;

cv::Size image_size(const Scene& scene, int camera) {
  const CameraModel& model = scene.cameras[static_cast<std::size_t>(camera)].model;
  return {model.width_px, model.height_px};
}

SmoothField field(const Scene& scene, int observation, int camera, std::string_view name, double grid_px) {
  return {stream_seed(scene.seed, name, static_cast<std::uint64_t>(observation), static_cast<std::uint64_t>(camera)),
          grid_px, image_size(scene, camera)};
}

}  // namespace

Haze::Haze(const Scene& scene, const Layout& layout, int observation, int camera)
    : rms_px_(scene.corruption * scene.imaging.haze_rms_px),
      plume_px_(0.2 * image_size(scene, camera).height),
      coarse_x_(field(scene, observation, camera, "haze coarse x", 2.5 * scene.imaging.haze_grid_px)),
      coarse_y_(field(scene, observation, camera, "haze coarse y", 2.5 * scene.imaging.haze_grid_px)),
      fine_x_(field(scene, observation, camera, "haze fine x", scene.imaging.haze_grid_px)),
      fine_y_(field(scene, observation, camera, "haze fine y", scene.imaging.haze_grid_px)) {
  const CameraModel& model = scene.cameras[static_cast<std::size_t>(camera)].model;
  const CameraPose& pose = layout.poses[static_cast<std::size_t>(camera)];
  const BodyPose& body = layout.body_poses[static_cast<std::size_t>(observation)];
  start_ = project(model, pose.cam_from_world(body.world_from_body(Eigen::Vector3d::Zero())));
  end_ = project(model, pose.cam_from_world(body.world_from_body({layout.body.length_mm(), 0.0, 0.0})));
}

ObservedPoint Haze::at(const ObservedPoint& p) const {
  if (rms_px_ <= 0.0) return {0.0, 0.0};
  const double dx = end_.x_px - start_.x_px, dy = end_.y_px - start_.y_px;
  const double t =
      std::clamp(((p.x_px - start_.x_px) * dx + (p.y_px - start_.y_px) * dy) / (dx * dx + dy * dy), 0.0, 1.0);
  const double beside = p.x_px - (start_.x_px + t * dx), above = start_.y_px + t * dy - p.y_px;
  const double u = beside / (0.5 * plume_px_), v = above / (above > 0.0 ? plume_px_ : 0.4 * plume_px_);
  const double near = std::exp(-0.5 * (u * u + v * v));
  const double rise = above > 0.0 ? v * std::exp(-0.5 * (v * v - 1.0)) * std::exp(-0.5 * u * u) : 0.0;
  const double strength = rms_px_ * (far_strength + (1.0 - far_strength) * near + plume_strength * rise);
  return {strength * (coarse_share * coarse_x_.at(p.x_px, p.y_px) + fine_share * fine_x_.at(p.x_px, p.y_px)),
          strength * (coarse_share * coarse_y_.at(p.x_px, p.y_px) + fine_share * fine_y_.at(p.x_px, p.y_px))};
}

}  // namespace imprint
