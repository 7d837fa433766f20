#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "lib/result/result.h"
#include "lib/rig/rig.h"

namespace imprint {

/// What the rig and the pose say about where the forging can be in the observed image.
struct SegmentPrior {
  double direction_x = 1.0;  ///< rough axis direction in the observed image, unit vector
  double direction_y = 0.0;
  double diameter_min_px = 0.0;  ///< range of the silhouette's width across the axis
  double diameter_max_px = 0.0;
  double likely_min_px = 0.0;  ///< the part of that range that is likely; 0: all of it
  double likely_max_px = 0.0;
  Polarity polarity = Polarity::bright;
};

struct SegmentConfig;  // in segment_config.h

/// Something else in view that is about as bright as the forging (of a dark forging: as dark), and why it was not
/// taken.
struct SeenBody {
  ObservedPoint middle;
  double length_px = 0.0;  ///< of the smallest rectangle about it
  double width_px = 0.0;
  std::string why_not;
};

/// The forging, roughly: a straight line in the observed image and, at every whole px along it,
/// where the two rims are expected. Coordinates: origin + station direction + offset normal, with the
/// normal the direction turned by +90 deg from x to y.
struct Segmentation {
  ObservedPoint origin;
  double direction_x = 1.0;
  double direction_y = 0.0;
  int first_station_px = 0;            ///< station of the first element of the vectors below
  std::vector<float> upper_offset_px;  ///< expected rim with the smaller offset; NaN where none was seen
  std::vector<float> lower_offset_px;
  double score = 0.0;            ///< the probability that it is the forging and its outline right
  std::vector<SeenBody> others;  ///< the largest first
};

/// Finds the one forging that fits the prior, [C] 2.3.2 "Forging segmentation".
/// Fails (job_failed) when nothing in the image fits, saying what was missing.
Result<Segmentation> segment_forging(const cv::Mat& image, const SegmentPrior& prior, const SegmentConfig& config);

}  // namespace imprint
