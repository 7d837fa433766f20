#pragma once

#include <map>
#include <random>
#include <vector>

#include "lib/camera/camera_model.h"
#include "lib/camera/camera_pose.h"
#include "survey/survey.h"

namespace imprint {

/// A field of targets and how it is photographed: measured centres computed, not rendered.
struct PhotographedField {
  struct Target {
    Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the plate, towards the viewer
  };
  CameraModel camera;
  std::map<int, Target> targets;
  std::vector<CameraPose> poses;
  double dot_radius_mm = 14.0;
  double noise_px = 0.02;
};

/// A reflex camera of 12 megapixels with a 24 mm lens and its distortion.
CameraModel reflex_camera();

/// Targets 1 to `count` on posts, walls and the floor of 6 x 6 x 2 m; targets 101 to 104 are the ends of two bars on
/// the floor, 2 m and 1 m long.
PhotographedField large_field(int count, int photos, std::mt19937& random);

/// A wall of 4 x 3 m, all targets within 2 mm of a plane.
PhotographedField flat_field(int count, int photos, std::mt19937& random);

/// What a detector would find: centres of the dots' images with noise.
std::vector<SurveyPhoto> photograph(const PhotographedField& field, std::mt19937& random);

/// The bars of large_field, exact.
std::vector<ScaleBar> bars_of(const PhotographedField& field);

/// Survey input with nothing known of the camera but its size.
SurveyInput input_of(const PhotographedField& field, std::mt19937& random);

/// Distances of the measured targets from the truth after a rigid best fit, root mean square, in mm.
double rms_after_fit(const PhotographedField& field, const Survey& survey);

}  // namespace imprint
