#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "lib/camera/camera_pose.h"
#include "lib/geometry/points.h"
#include "node/edge/silhouette_frame.h"

namespace imprint::bench {

/// What truth.json (docs/scene.md) says of one camera in one observation, observed px without haze.
struct ImageTruth {
  CameraPose pose;
  std::vector<ObservedPoint> upper, lower;
  ObservedPoint start, end;
};

ImageTruth image_truth(const nlohmann::json& truth, int observation, const std::string& camera_id);

/// A true rim in a segmentation's frame, as a function of the station.
class TrueRim {
 public:
  TrueRim(const std::vector<ObservedPoint>& rim, const SilhouetteFrame& frame);

  [[nodiscard]] double first_station_px() const { return points_.front().station; }
  [[nodiscard]] double last_station_px() const { return points_.back().station; }
  /// NaN outside its stations.
  [[nodiscard]] double offset_px(double station_px) const;

 private:
  struct Point {
    double station, offset;
  };
  std::vector<Point> points_;
};

}  // namespace imprint::bench
