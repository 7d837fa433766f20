#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "lib/geometry/points.h"
#include "simulation/layout.h"
#include "simulation/scene.h"

namespace imprint {

/// What stands about the forging, as one camera shows it: manipulator, V-blocks, other hot bodies.
struct Prop {
  std::vector<ObservedPoint> outline;  ///< convex
  bool before_forging = false;
  double distance_mm = 0.0;  ///< of its middle from the camera
  double level = 0.0;        ///< share of full scale
  double grain = 0.0;        ///< share of the level by which its texture varies
  double limb = 0.0;         ///< u of 1 - u (1 - cos theta) about the line from axis_from to axis_to; 0: flat
  ObservedPoint axis_from, axis_to;
  std::uint64_t seed = 0;
};

/// The props that the camera sees, the farthest first.
std::vector<Prop> props_of(const Scene& scene, const Layout& layout, int observation, int camera);

/// Lays those that stand before the forging, or those behind it, over the image by their exact coverage.
void paint_props(const std::vector<Prop>& props, bool before_forging, cv::Mat& image);

/// The stretches of a rim that props hide, in mm along the forging: `rim` runs evenly from 0 to `length_mm`.
std::vector<std::pair<double, double>> hidden_ranges_mm(const std::vector<Prop>& props,
                                                        const std::vector<ObservedPoint>& rim, double length_mm);

}  // namespace imprint
