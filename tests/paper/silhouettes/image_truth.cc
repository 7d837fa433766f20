#include "tests/paper/silhouettes/image_truth.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace imprint::bench {
namespace {

ObservedPoint point(const nlohmann::json& json) { return {json.at(0).get<double>(), json.at(1).get<double>()}; }

std::vector<ObservedPoint> points(const nlohmann::json& json) {
  std::vector<ObservedPoint> list;
  for (const auto& item : json) list.push_back(point(item));
  return list;
}

}  // namespace

ImageTruth image_truth(const nlohmann::json& truth, int observation, const std::string& camera_id) {
  for (const auto& camera : truth.at("observations").at(static_cast<std::size_t>(observation)).at("cameras")) {
    if (camera.at("id") != camera_id) continue;
    ImageTruth image;
    for (int i = 0; i < 3; ++i) image.pose.center_world_mm[i] = camera.at("center_mm").at(static_cast<std::size_t>(i));
    for (int i = 0; i < 9; ++i)
      image.pose.R_cam_world(i / 3, i % 3) = camera.at("R_cam_world").at(static_cast<std::size_t>(i));
    image.upper = points(camera.at("upper")), image.lower = points(camera.at("lower"));
    image.start = point(camera.at("start_px")), image.end = point(camera.at("end_px"));
    return image;
  }
  throw std::runtime_error("truth.json: observation " + std::to_string(observation) + " has no camera " + camera_id);
}

TrueRim::TrueRim(const std::vector<ObservedPoint>& rim, const SilhouetteFrame& frame) {
  for (const ObservedPoint& p : rim) points_.push_back({frame.station_px(p), frame.offset_px(p)});
  if (points_.front().station > points_.back().station) std::reverse(points_.begin(), points_.end());
}

double TrueRim::offset_px(double station_px) const {
  const auto after = std::lower_bound(points_.begin(), points_.end(), station_px,
                                      [](const Point& p, double station) { return p.station < station; });
  if (after == points_.begin() || after == points_.end()) return std::nan("");
  const Point &a = *(after - 1), &b = *after;
  return a.offset + (b.offset - a.offset) * (station_px - a.station) / (b.station - a.station);
}

}  // namespace imprint::bench
