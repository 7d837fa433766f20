#pragma once

#include <vector>

#include "node/edge/edge_config.h"
#include "node/edge/locate_edges.h"
#include "node/edge/silhouette_frame.h"

namespace imprint {

enum class RimSide { upper, lower };

/// Where a rim is expected, one point a station, in ascending station without gaps in between.
struct ExpectedRim {
  RimSide side = RimSide::upper;
  int first_station_px = 0;
  std::vector<double> offset_px;  ///< NaN: do not look there
  std::vector<float> body;        ///< brightness of the body, one a station; NaN: unknown
};

/// The edge points of one rim, with the step across it.
struct RimEdges {
  std::vector<EdgePoint> points;
  std::vector<float> step;  ///< one a point, share of full scale
};

/// `pixel`: the highest gradient of every scan line. The other methods of [C]: zero crossing on scan lines normal to
/// the axis. `best`: a blurred step fitted to the pixels of every image column (row, for a forging that stands
/// upright), where no interpolation blurs or ties the noise of neighbours, with the blur from its surroundings.
RimEdges find_rim_edges(const cv::Mat& image, const SilhouetteFrame& frame, const ExpectedRim& rim, Polarity polarity,
                        EdgeMethod method, const EdgeConfig& config);

}  // namespace imprint
