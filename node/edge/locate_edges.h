#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "node/segment/segment.h"

namespace imprint {

/// One subpixel edge point on the scan line of one station.
struct EdgePoint {
  int station_px = 0;
  double offset_px = 0.0;
  double magnitude = 0.0;       ///< gradient magnitude, share of full scale per px
  double direction_deg = 90.0;  ///< gradient direction against the forging axis; 90 = perpendicular
  double sigma_px = 0.0;        ///< expected standard deviation of the offset
  double body_share = 1.0;      ///< step across the edge over that from its outside up to the body's brightness
  double outside_dip = 0.0;     ///< a strip outside it darker than the background, share of the step (`best`)
  double outside_bump = 0.0;    ///< a strip outside it brighter than the background, likewise
  double inside_ledge = 0.0;    ///< a strip inside it darker than the body further in, likewise
  double blur_excess = 0.0;     ///< how much wider it is than the region's edges, share of their blur (`best`)
};

struct LocatedEnd {
  double station_px = 0.0;
  double offset_px = 0.0;
  double sigma_px = 0.0;
  bool visible = false;
};

/// The silhouette of the forging in the observed image, before filtering; frame of the segmentation.
struct Silhouette {
  Segmentation frame;            ///< origin and direction of stations and offsets
  std::vector<EdgePoint> upper;  ///< ascending station, at most one a station
  std::vector<EdgePoint> lower;
  LocatedEnd start;  ///< end with the smaller station
  LocatedEnd end;
  double contrast = 0.0;  ///< median step across the rims, share of full scale
  double saturated_fraction = 0.0;
};

enum class EdgeMethod { best, orientation, magnitude, combined, uniform, none, pixel };

struct EdgeConfig;  // in edge_config.h

/// Subpixel rims and ends along the segmentation's scan lines, [C] 2.3.2 "Subpixel edge detection":
/// zero crossing of the second derivative with a line fit (`pixel`: the pixel of the highest gradient).
Silhouette locate_edges(const cv::Mat& image, const Segmentation& segmentation, Polarity polarity, EdgeMethod method,
                        const EdgeConfig& config);

/// Names as in contract section 3.
Result<EdgeMethod> edge_method_from_name(std::string_view name);
std::string_view edge_method_name(EdgeMethod method);

}  // namespace imprint
