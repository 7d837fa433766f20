#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "lib/geometry/points.h"
#include "lib/targets/target_library.h"

namespace imprint {

/// One coded target found in an image.
struct DetectedTarget {
  int id = 0;
  ObservedPoint center;          ///< of the dot's ellipse
  double sigma_px = 0.0;         ///< standard deviation of each coordinate of the centre
  double dot_diameter_px = 0.0;  ///< mean of the ellipse's axes
  double distance = 0.0;         ///< rotation-invariant distance to the code taken, [A] equation 14
};

struct DetectConfig;  // in detect_config.h

/// The coded targets of an image, each id at most once, by ascending id. Finding none is an empty vector.
/// `image`: one channel, 8 or 16 bit. Method: [A] 2.3.1 to 2.3.8.
std::vector<DetectedTarget> detect_targets(const cv::Mat& image, const TargetLibrary& library,
                                           const DetectConfig& config);

}  // namespace imprint
