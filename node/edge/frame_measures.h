#pragma once

#include <opencv2/core.hpp>

#include "node/edge/locate_edges.h"

namespace imprint {

/// How well a frame was taken, read off the forging in it; the same for every edge method.
struct FrameMeasures {
  /// Standard deviation of the blur across the rims, the pixel's own area left out: median over both rims. 0: unknown.
  double blur_px = 0.0;
  double haze_px = 0.0;  ///< rim_haze_px
  /// 99.5 percentile of the forging, of its surroundings where it is dark; share of full scale.
  double body_level = 0.0;
  /// Share of saturated pixels in the whole frame, lamps and all.
  double frame_saturated_fraction = 0.0;
};

FrameMeasures measure_frame(const cv::Mat& image, const Silhouette& silhouette, Polarity polarity);

}  // namespace imprint
