#pragma once

#include <vector>

#include <Eigen/Core>

#include "lib/camera/camera_pose.h"
#include "lib/result/result.h"
#include "lib/targets/target_library.h"
#include "simulation/body_pose.h"
#include "simulation/forging_body.h"
#include "simulation/scene.h"

namespace imprint {

enum class PlateState { clean, dirty, hidden };

/// A coded target on its plate. Plate frame: x right and y down as seen from the front, z away from the viewer.
struct Plate {
  TargetCode code;
  Eigen::Vector3d center_world_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_world_plate = Eigen::Matrix3d::Identity();
  PlateState state = PlateState::clean;
  double brightness = 1.0;                                     ///< of the light that falls on it
  double cover_mm = 1e9;                                       ///< hidden: beyond this distance from the centre...
  Eigen::Vector2d cover_direction = Eigen::Vector2d::UnitX();  ///< ...in this direction of the plate
};

/// Everything a scene leaves to chance or computation, fixed: the same for all frames.
struct Layout {
  ForgingBody body;
  TargetLibrary library;
  std::vector<CameraPose> poses;     ///< by camera of the scene
  std::vector<BodyPose> body_poses;  ///< by observation
  std::vector<Plate> plates;
};

/// Fails (invalid_input) when the body is not convex, the library cannot be read or too small for the plates.
Result<Layout> lay_out(const Scene& scene);

/// Where a camera of the scene stands.
CameraPose camera_pose(const SceneCamera& camera);

/// Cosine of the angle between the plate's normal and the line of sight; negative from behind.
double plate_facing(const Plate& plate, const CameraPose& pose);

}  // namespace imprint
