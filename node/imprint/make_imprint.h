#pragma once

#include <vector>

#include "lib/camera/camera_model.h"
#include "lib/imprint/imprint.h"
#include "lib/result/result.h"
#include "node/edge/locate_edges.h"

namespace imprint {

struct FilterConfig;  // in filter_config.h

/// One filtered curve in the observed image, ascending station.
struct FilteredPoint {
  double station_px = 0.0;
  double offset_px = 0.0;
  double weight = 0.0;  ///< 0 to 1
};

/// Validated and filtered rims and axis, still in the observed image (what `imprint edges` shows).
struct FilteredSilhouette {
  Segmentation frame;
  std::vector<FilteredPoint> upper, lower, axis;
  LocatedEnd start, end;
};

/// Validation by connected regions, weights by [C] equation 1, weighted parabola fit (windows 10 and 40);
/// the axis is the middle of the rims with the lower of their weights. `best` adds what is ours.
/// Fails (job_failed) when too little of the rims is left to describe a forging.
Result<FilteredSilhouette> filter_silhouette(const Silhouette& silhouette, EdgeMethod method,
                                             const FilterConfig& config);

/// Fills grid, curves and ends of an imprint: distortion removed, 500 stations a curve.
/// Nothing else of the imprint is touched.
Result<void> fill_curves(const FilteredSilhouette& silhouette, const CameraModel& camera, Imprint& imprint);

}  // namespace imprint
