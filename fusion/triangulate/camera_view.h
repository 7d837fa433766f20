#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

#include "lib/imprint/imprint.h"

namespace imprint {

/// A viewing ray of one curve point; weight 0 where the curve is not to be trusted.
struct CurveRay {
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitZ();  ///< length 1
  double weight = 0.0;
};

/// The outermost point of the outline at one end, as a ray.
struct EndRay {
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitZ();
  double sigma_px = 0.0;
  bool visible = false;
};

/// What fusion uses of one imprint: its curves as rays in the world, one a station.
struct CameraView {
  int camera = 0;  ///< index among the observation's imprints
  CameraPose pose;
  double focal_length_px = 0.0;
  std::vector<CurveRay> upper, lower, axis;
  EndRay start, end;         ///< at the smaller and the larger station
  double blind_share = 0.0;  ///< longest run of stations without either rim, of all
};

/// The rays of an imprint. When it cannot be used: why, for the operator.
tl::expected<CameraView, std::string> view_of(const Imprint& imprint, int camera, double min_rim_share);

}  // namespace imprint
