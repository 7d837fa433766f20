#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "lib/geometry/points.h"

namespace imprint {

/// The share of each pixel that lies inside a polygon.
struct Coverage {
  cv::Rect region;  ///< pixels of the image that the polygon can touch; empty when it lies outside
  cv::Mat share;    ///< of the region, CV_64F, 0 to 1
};

/// Exact coverage (up to double rounding) of a closed simple polygon given by its vertices, in either sense of
/// rotation, clipped to an image of the given size. Pixel (i, j) is the square of side 1 around (i, j).
Coverage polygon_coverage(const std::vector<ObservedPoint>& polygon, cv::Size image);

}  // namespace imprint
