#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "lib/imprint/imprint.h"
#include "lib/result/result.h"
#include "lib/rig/rig.h"

namespace imprint {

struct TriangulateConfig;  // in triangulate_config.h

/// A plane that touches the forging: the viewing plane of one silhouette point at one section.
/// normal_world . x = offset_mm, the normal (length 1) pointing out of the forging.
struct TangentPlane {
  Eigen::Vector3d normal_world = Eigen::Vector3d::UnitY();
  double offset_mm = 0.0;
  double sigma_mm = 0.0;   ///< of the offset
  double mm_per_px = 0.0;  ///< scale across the ray where it touches
  double weight = 1.0;     ///< 0 to 1, from the imprint
  int camera = 0;          ///< index into `cameras` of the observation
  bool upper = false;      ///< which rim of that camera
  bool stray = false;      ///< too far from what most rims agree on to have a say before the rod is known better
  double s_mm = 0.0;       ///< where along the observation's straight line the plane touches
  Eigen::Vector3d ray_world = Eigen::Vector3d::UnitZ();  ///< from the camera's centre to the rim point, length 1
};

/// Where one camera saw the outline of one end furthest out, near the axis: a ray to the end's circle.
struct EndReading {
  int camera = 0;     ///< index into `cameras` of the observation
  bool last = false;  ///< the end with the larger coordinate along the axis
  Eigen::Vector3d ray_world = Eigen::Vector3d::UnitZ();
  double sigma_mm = 0.0;  ///< along the axis, of the reading alone
};

/// One cross-section of one observation.
struct ObservedSection {
  double s_mm = 0.0;  ///< along the observation's straight line from its start
  Eigen::Vector3d axis_world_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0.0;  ///< on which most rims agree
  std::vector<TangentPlane> tangents;
};

struct CameraShare {
  std::string id;
  CameraPose pose;
  double reprojection_rms_px = 0.0;
  int targets_used = 0;
  int edge_points = 0;
  PoseState pose_state = PoseState::tracking;
  bool pose_doubtful = false;  ///< the camera had moved, or may have
  bool excluded = false;
  std::string reason;  ///< why excluded
};

/// What one observation says of the forging: [D] equations 1 to 4.
struct ObservedForging {
  Eigen::Vector3d start_world_mm = Eigen::Vector3d::Zero();  ///< axis point at the first end
  Eigen::Vector3d end_world_mm = Eigen::Vector3d::Zero();
  double length_sigma_mm = 0.0;
  double radius_mm = 0.0;        ///< median of the sections
  double out_of_round_mm = 0.0;  ///< robust sigma of the tangents about the circles on which most rims agree
  std::vector<EndReading> ends;
  double disagreement_sigma_mm = 0.0;  ///< of a camera's place across the axis, where cameras contradict each other
  std::vector<ObservedSection> sections;
  std::vector<CameraShare> cameras;
  std::vector<std::string> warnings;
};

/// Axis and silhouettes in space of one observation. A camera whose imprint contradicts the others or
/// carries too little is left out and named. Fails (job_failed) with fewer than two usable cameras.
Result<ObservedForging> triangulate(std::span<const Imprint> imprints, const ForgingSpec& forging,
                                    const TriangulateConfig& config);

}  // namespace imprint
