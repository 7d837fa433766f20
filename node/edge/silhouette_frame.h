#pragma once

#include <cmath>

#include "node/segment/segment.h"

namespace imprint {

/// Stations and offsets of a segmentation and points of the observed image, each from the other.
struct SilhouetteFrame {
  ObservedPoint origin;
  double direction_x = 1.0, direction_y = 0.0;

  explicit SilhouetteFrame(const Segmentation& s)
      : origin(s.origin), direction_x(s.direction_x), direction_y(s.direction_y) {}

  [[nodiscard]] ObservedPoint at(double station_px, double offset_px) const {
    return {origin.x_px + station_px * direction_x - offset_px * direction_y,
            origin.y_px + station_px * direction_y + offset_px * direction_x};
  }
  [[nodiscard]] double station_px(const ObservedPoint& p) const {
    return (p.x_px - origin.x_px) * direction_x + (p.y_px - origin.y_px) * direction_y;
  }
  [[nodiscard]] double offset_px(const ObservedPoint& p) const {
    return (p.y_px - origin.y_px) * direction_x - (p.x_px - origin.x_px) * direction_y;
  }
};

}  // namespace imprint
