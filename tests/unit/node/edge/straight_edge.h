#pragma once

#include <opencv2/core.hpp>

#include "node/edge/locate_edges.h"

namespace imprint::drawn {

/// A bright band between two parallel straight rims over the whole image, drawn without approximation: a step blurred
/// by a Gaussian, every pixel the mean over its area.
struct StraightBand {
  double slope = 0.0;        ///< of the rims, px of offset per px of station
  double phase_px = 0.0;     ///< of the upper rim's offset at station 0, whole px left out
  double width_px = 100.0;   ///< along the scan lines
  double blur_px = 1.0;      ///< standard deviation, the pixel's own area left out
  double background = 50.0;  ///< of 255
  double contrast = 100.0;   ///< grey levels
  bool columns = true;       ///< the rims run along the rows and are scanned down the columns; else the other way
  int length_px = 640;

  [[nodiscard]] cv::Size size() const;
  [[nodiscard]] double upper_offset_px(double station_px) const { return phase_px + slope * station_px; }
  /// What a first stage that sees the band would give, `error_px` off; its axis along the rows or columns, so that the
  /// edge points of `best` are those of single lines of pixels.
  [[nodiscard]] Segmentation segmentation(double error_px = 0.3) const;
};

/// 0 to 255, not rounded.
cv::Mat_<float> draw(const StraightBand& band);

/// Smallest standard deviation, in px along the scan line, that an unbiased estimator can have from the 2 `reach_px` +
/// 1 pixels about the edge of one scan line across a rim of that slope, for a noise of 1 and a contrast of 1: the
/// Cramer-Rao bound for a step blurred by `blur_px` and the pixel's area, averaged over the subpixel phases, everything
/// known but the position, or level, contrast and (`free_blur`) blur unknown too.
enum class Unknown { position, levels, levels_and_blur };
double bound_px(double blur_px, double slope, int reach_px, Unknown unknown);

}  // namespace imprint::drawn
