#pragma once

#include <functional>
#include <vector>

#include <opencv2/core.hpp>

#include "lib/geometry/points.h"
#include "node/segment/segment.h"

namespace imprint::drawn {

/// A stretch of one rim that shows another grey level down to `depth_px` from the rim.
struct Patch {
  double from_px = 0, to_px = 0;
  bool upper = true;
  double depth_px = 0;
  double level = 0;
};

/// A body drawn by its distance to its outline, blurred by a Gaussian, each pixel the mean over its area.
struct Body {
  ObservedPoint origin;  ///< station 0, offset 0
  double tilt_rad = 0;   ///< of the axis against the rows
  double start_px = 0, end_px = 0;
  std::function<double(double)> half_width_px = [](double) { return 50.0; };
  std::function<double(double)> middle_px = [](double) { return 0.0; };
  double end_bulge_px = 0;  ///< how far the apex of the end's arc stands out, at both ends
  double level = 150;       ///< of 255
  double background = 30;
  double blur_px = 0.9;
  std::vector<Patch> patches;

  [[nodiscard]] ObservedPoint at(double station_px, double offset_px) const;
  /// Station and offset of a point.
  [[nodiscard]] cv::Vec2d along_and_across(double x_px, double y_px) const;
};

/// The body on its background, float, 0 to 255.
cv::Mat_<float> draw(const Body& body, cv::Size size);

/// A plain rectangle over the image, edges on pixel borders.
void draw_bar(cv::Mat_<float>& image, cv::Rect where, float level);

/// Gaussian noise added, rounded to 8 or 16 bit (16 bit: 257 times the level).
cv::Mat expose(const cv::Mat_<float>& image, double noise, unsigned seed, int depth = CV_8U);

}  // namespace imprint::drawn
