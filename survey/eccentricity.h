#pragma once

#include <vector>

#include <Eigen/Core>

#include "survey/network.h"

namespace imprint {

/// A target's dot in space, from the sizes of its images.
struct DotDisc {
  double radius = 0.0;                                ///< in the network's unit
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< length 1, towards the cameras
  int sights = 0;                                     ///< that told
};

/// The discs of all targets of an adjusted network that four or more sights show: radius and normal with which the mean
/// diameters seen agree best. Sights without a diameter count for nothing.
std::map<int, DotDisc> find_dot_discs(const Network& network, const std::vector<Sight>& sights);

/// How far the centre of the disc's image lies from the image of its centre, in observed px: perspective makes the
/// nearer half larger, and the lens bends across the dot. The disc must lie before the camera.
ObservedPoint eccentricity_px(const CameraModel& camera, const CameraPose& pose, const Eigen::Vector3d& p_world,
                              const DotDisc& disc);

/// Takes the eccentricity out of every sight whose target's disc is known.
void correct_eccentricity(const Network& network, std::vector<Sight>& sights);

}  // namespace imprint
