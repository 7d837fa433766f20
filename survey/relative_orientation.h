#pragma once

#include <vector>

#include <Eigen/Core>

#include "lib/camera/camera_pose.h"

namespace imprint {

/// A target seen in two photographs: the rays through (x, y, 1) in the axes of either camera.
struct RayPair {
  Eigen::Vector2d first = Eigen::Vector2d::Zero(), second = Eigen::Vector2d::Zero();
};

/// Poses of a second camera that agree with what both see, seen from a first camera at the origin; the base has
/// length 1. Two kinds of start, because either fails where the other is at home: the essential matrix from five
/// points, for targets spread in depth, and the homography, for targets on a floor or a wall, which leaves up to two
/// poses that only a third photograph can decide between. Wrong ids are outvoted. `tolerance`: in units of the image
/// plane z = 1.
std::vector<CameraPose> relative_poses(const std::vector<RayPair>& pairs, double tolerance);

/// How far the two views are from a mere turn of the camera, in rad: the wider, the better they intersect.
/// Median over the targets, so that wrong ids do not make it.
double parallax_rad(const std::vector<RayPair>& pairs);

}  // namespace imprint
