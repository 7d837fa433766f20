#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "lib/camera/camera_model.h"
#include "lib/camera/camera_pose.h"
#include "node/detect/detect_targets.h"

namespace imprint {

/// One photograph of the field and the coded targets found in it.
struct SurveyPhoto {
  std::string name;  ///< for messages
  std::vector<DetectedTarget> targets;
};

/// One target seen in one photograph.
struct Sight {
  std::size_t photo = 0;
  int id = 0;
  ObservedPoint at;  ///< as detected, less `eccentricity`
  ObservedPoint eccentricity_px;
  double sigma_px = 0.0;
  double dot_diameter_px = 0.0;
  bool used = true;
  Eigen::Vector2d residual_px = Eigen::Vector2d::Zero();  ///< observed minus projected
};

/// Camera, poses and targets that belong together. Lengths are in mm once a scale bar has set them; before, in a unit
/// of the network's own. The frame is any until the datum is set.
struct Network {
  CameraModel camera;
  std::vector<std::optional<CameraPose>> poses;  ///< by photograph; none while it is not connected
  std::map<int, Eigen::Vector3d> points;         ///< by target id

  [[nodiscard]] int posed() const {
    int count = 0;
    for (const auto& pose : poses) count += pose ? 1 : 0;
    return count;
  }
  /// Whether both ends of the sight are part of the network.
  [[nodiscard]] bool holds(const Sight& sight) const { return poses[sight.photo] && points.count(sight.id) > 0; }
};

/// Multiplies all lengths.
void scale_network(Network& network, double factor);

/// Moves the network: p' = R (p - origin).
void move_network(Network& network, const Eigen::Matrix3d& R, const Eigen::Vector3d& origin);

}  // namespace imprint
