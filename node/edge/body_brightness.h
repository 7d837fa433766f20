#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "lib/rig/rig.h"
#include "node/edge/silhouette_frame.h"

namespace imprint {

/// Grey value of the pixel nearest to `p`, share of full scale, a dark body inverted; negative outside the image.
float grey_at(const cv::Mat& image, const ObservedPoint& p, Polarity polarity);

/// How bright the body is along its axis, one value a station from `first_station_px` on, share of full scale (a dark
/// body inverted): upper quartile over the middle 60 % of every section, median over its neighbourhood, so that neither
/// patches of scale nor sparks count. NaN where the rims given (offsets, one a station) are unknown or outside the
/// image.
std::vector<float> body_brightness(const cv::Mat& image, const SilhouetteFrame& frame, int first_station_px,
                                   const std::vector<double>& upper_offset_px,
                                   const std::vector<double>& lower_offset_px, Polarity polarity);

/// How far a step from `outside` to `inside` goes from the background up to the body's brightness: near 1 at the rim,
/// well below at the edge of a beam behind the forging, which is darker than hot steel.
inline float share_of_body(float outside, float inside, float body) {
  return (inside - outside) / std::max(body - outside, 1e-3F);
}

}  // namespace imprint
