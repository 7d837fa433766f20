#pragma once

#include <opencv2/core.hpp>

#include "simulation/haze.h"
#include "simulation/layout.h"

namespace imprint {

/// Paints every plate whose front the camera sees into `image` (CV_32F, shares of full scale), each pixel as the mean
/// over its area.
void paint_plates(const Scene& scene, const Layout& layout, int camera, const Haze& haze, cv::Mat& image);

/// The dot of a plate as the camera shows it, without haze.
struct DotImage {
  ObservedPoint center;          ///< image of the dot's centre
  ObservedPoint ellipse_center;  ///< centre of the dot's image, which perspective moves away from `center`
  double diameter_px = 0.0;      ///< of the circle of the same area
};

DotImage dot_image(const Plate& plate, double dot_diameter_mm, const CameraModel& camera, const CameraPose& pose);

}  // namespace imprint
