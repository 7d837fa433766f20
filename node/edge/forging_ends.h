#pragma once

#include <optional>

#include "node/edge/edge_config.h"
#include "node/edge/locate_edges.h"
#include "node/edge/silhouette_frame.h"

namespace imprint {

/// The part of the axis near one end that the search starts from.
struct EndSearch {
  bool at_start = true;     ///< the end with the smaller station
  double station_px = 0.0;  ///< coarse
  double axis_offset_px = 0.0;
  double diameter_px = 0.0;
};

/// The coarse station at which the body's brightness falls off most along the axis, near the end that the segmentation
/// saw; nothing when it goes on to the border of the image.
std::optional<double> walk_to_end(const cv::Mat& image, const SilhouetteFrame& frame, const EndSearch& search,
                                  Polarity polarity);

/// The end to subpixel: edges on scan lines along the axis (along pixel rows or columns) within a band about it, half
/// an ellipse through those that agree (the outline there is an arc of the end face), its apex on the axis.
LocatedEnd locate_end(const cv::Mat& image, const SilhouetteFrame& frame, const EndSearch& search, Polarity polarity,
                      const EdgeConfig& config);

}  // namespace imprint
