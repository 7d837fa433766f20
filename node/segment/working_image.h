#pragma once

#include <opencv2/core.hpp>

#include "lib/geometry/points.h"
#include "node/segment/segment.h"
#include "node/segment/segment_config.h"

namespace imprint {

/// The image shrunk; a dark forging is inverted, so it is always brighter.
struct ReducedImage {
  cv::Mat_<float> intensity;  ///< share of full scale
  int reduction = 1;
  double quantum = 1.0 / 255;  ///< one grey level, share of full scale
};

/// Shrunk by as much as leaves the narrowest forging `min_reduced_diameter_px` wide, at most by `max_reduction`.
ReducedImage reduce_image(const cv::Mat& image, const SegmentPrior& prior, const SegmentConfig& config);

/// Shrunk once more by 2.
ReducedImage halve(const ReducedImage& reduced);

/// The image shrunk and turned so that a direction runs along +x.
struct WorkingImage {
  cv::Mat_<float> intensity;      ///< share of full scale; a dark forging is inverted, so it is always brighter
  cv::Mat_<unsigned char> valid;  ///< 255 where the camera saw something
  int reduction = 1;
  double shorter_side_px = 0.0;     ///< of the whole reduced image
  double quantum = 1.0 / 255;       ///< one grey level, share of full scale
  cv::Matx23d source_from_working;  ///< working px -> px of the observed image

  [[nodiscard]] ObservedPoint observed(double x_px, double y_px) const {
    const cv::Vec2d p = source_from_working * cv::Vec3d(x_px, y_px, 1.0);
    return {p[0], p[1]};
  }
};

WorkingImage turn_image(const ReducedImage& reduced, double direction_x, double direction_y);

}  // namespace imprint
