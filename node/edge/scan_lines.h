#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "lib/geometry/points.h"

namespace imprint {

/// Grey values along one line across a rim, from outside to inside: sample i stands at
/// foot + (first_px + i spacing) inward, and is the share of full scale, a dark body inverted.
struct ScanLine {
  int index = 0;  ///< neighbours along the rim have indices 1 apart
  ObservedPoint foot;
  double first_px = 0.0;
  double expected_px = 0.0;  ///< where along the line the rim is expected
  double slope = 0.0;        ///< of the expected rim, px per index
  std::size_t begin = 0;     ///< of its samples in ScanLines::values
  int count = 0;
};

struct ScanLines {
  cv::Vec2d inward{0, 1};  ///< unit vector in the image
  double spacing_px = 1.0;
  std::vector<ScanLine> lines;
  std::vector<float> values;

  [[nodiscard]] const float* samples(const ScanLine& line) const { return values.data() + line.begin; }
  [[nodiscard]] ObservedPoint at(const ScanLine& line, double position_px) const {
    return {line.foot.x_px + position_px * inward[0], line.foot.y_px + position_px * inward[1]};
  }
};

/// One scan line to be read: where it starts from and the stretch that is wanted.
struct ScanRequest {
  int index = 0;
  ObservedPoint foot;
  double from_px = 0.0;
  double to_px = 0.0;
  double expected_px = 0.0;
  double slope = 0.0;
};

/// Reads the lines with bilinear interpolation (none where the samples fall on pixels), clipped to the image;
/// lines with fewer than 8 samples in the image are left out.
ScanLines read_scan_lines(const cv::Mat& image, const std::vector<ScanRequest>& requests, cv::Vec2d inward,
                          double spacing_px, bool invert);

}  // namespace imprint
