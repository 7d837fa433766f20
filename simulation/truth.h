#pragma once

#include <string>

#include <Eigen/Core>

#include "lib/result/result.h"
#include "simulation/layout.h"
#include "simulation/scene.h"

namespace imprint {

/// The forging's own frame of one observation: x along the ideal axis from the first end, z as near to world z as
/// that allows (world y where x is within 10 deg of world z). X_forging = R (X_world - origin).
struct ForgingFrame {
  Eigen::Matrix3d R_forging_world = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_world_mm = Eigen::Vector3d::Zero();
};

ForgingFrame forging_frame(const BodyPose& pose);

/// truth.json (docs/scene.md) of a scene laid out. Fails as body_outline does.
Result<std::string> truth_json(const Scene& scene, const Layout& layout);

}  // namespace imprint
