#include "simulation/layout.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "simulation/code_set.h"
#include "simulation/plate_layout.h"
#include "simulation/random.h"

namespace imprint {
namespace {

constexpr double rad_per_deg = std::numbers::pi / 180.0;

BodyPose body_pose(const Scene& scene, int observation) {
  const ObservationScene& o = scene.observations;
  Random random(stream_seed(scene.seed, "positioning", static_cast<std::uint64_t>(observation)));
  const auto within = [&](double limit) { return random.uniform(-limit, limit); };
  BodyPose pose;
  pose.shift_mm = {within(o.position_error_mm), within(o.position_error_mm), within(o.position_error_mm)};
  pose.true_rotation_deg = o.rotations_deg[static_cast<std::size_t>(observation)] + within(o.rotation_error_deg);
  const double yaw = scene.forging.yaw_deg + within(o.tilt_error_deg);
  const double pitch = scene.forging.pitch_deg + within(o.tilt_error_deg);
  const Eigen::Quaterniond along_axis =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), scene.spec.axis_direction_world);
  pose.R_world_body = (Eigen::AngleAxisd(yaw * rad_per_deg, Eigen::Vector3d::UnitZ()) *
                       Eigen::AngleAxisd(pitch * rad_per_deg, Eigen::Vector3d::UnitY()) * along_axis *
                       Eigen::AngleAxisd(pose.true_rotation_deg * rad_per_deg, Eigen::Vector3d::UnitX()))
                          .toRotationMatrix();
  pose.origin_world_mm = scene.forging.center_world_mm + pose.shift_mm -
                         pose.R_world_body * Eigen::Vector3d(0.5 * scene.forging.length_mm, 0.0, 0.0);
  return pose;
}

Result<TargetLibrary> library_of(const Scene& scene) {
  if (!scene.targets.library.empty()) return read_target_library(scene.targets.library);
  return scene_library();
}

}  // namespace

CameraPose camera_pose(const SceneCamera& camera) {
  const double elevation = camera.elevation_deg * rad_per_deg;
  CameraPose pose;
  pose.center_world_mm =
      camera.aim_world_mm + Eigen::Vector3d(camera.offset_x_mm, camera.distance_mm * std::cos(elevation),
                                            camera.distance_mm * std::sin(elevation));
  const Eigen::Vector3d forward = (camera.aim_world_mm - pose.center_world_mm).normalized();
  const Eigen::Vector3d level_right = forward.cross(Eigen::Vector3d::UnitZ());
  // Straight down or up there is no level: x of the image along world x.
  const Eigen::Vector3d right = level_right.norm() > 1e-3
                                    ? Eigen::Vector3d(level_right.normalized())
                                    : Eigen::Vector3d((Eigen::Vector3d::UnitX() - forward * forward.x()).normalized());
  const Eigen::Vector3d down = forward.cross(right);
  Eigen::Matrix3d level;
  level << right.transpose(), down.transpose(), forward.transpose();
  pose.R_cam_world =
      Eigen::AngleAxisd(camera.roll_deg * rad_per_deg, Eigen::Vector3d::UnitZ()).toRotationMatrix() * level;
  return pose;
}

double plate_facing(const Plate& plate, const CameraPose& pose) {
  return (plate.center_world_mm - pose.center_world_mm).normalized().dot(plate.R_world_plate.col(2));
}

Result<Layout> lay_out(const Scene& scene) {
  auto body = ForgingBody::make(scene.forging, scene.spec.end_section_mm, stream_seed(scene.seed, "body"));
  if (!body) return pass_on(body.error());
  auto library = library_of(scene);
  if (!library) return pass_on(library.error());
  Layout layout{std::move(*body), std::move(*library), {}, {}, {}};
  for (const SceneCamera& camera : scene.cameras) layout.poses.push_back(camera_pose(camera));
  for (int i = 0; i < static_cast<int>(scene.observations.rotations_deg.size()); ++i) {
    layout.body_poses.push_back(body_pose(scene, i));
  }
  auto plates = place_plates(scene, layout);
  if (!plates) return pass_on(plates.error());
  layout.plates = std::move(*plates);
  return layout;
}

}  // namespace imprint
