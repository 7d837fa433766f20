#pragma once

#include <vector>

#include "node/edge/edge_path.h"

namespace imprint {

/// An edge of one scan line, to subpixel.
struct StepEdge {
  std::size_t line = 0;  ///< index into ScanLines::lines
  double position_px = 0.0;
  double sigma_px = 0.0;
  double step = 0.0;     ///< share of full scale
  double blur_px = 1.0;  ///< standard deviation, where it was fitted
};

/// Blurred steps fitted to the traced edges. The blur is first fitted freely on a part of the lines, its median taken
/// per `region_lines` lines, then kept: one unknown less for each line. Edges that no step fits are left out.
std::vector<StepEdge> fit_step_edges(const ScanLines& scan, const std::vector<TracedEdge>& traced, int region_lines);

/// Zero crossings of the second derivative at the traced edges.
std::vector<StepEdge> zero_crossing_edges(const ScanLines& scan, const std::vector<TracedEdge>& traced);

/// The sample of the highest gradient of every line, whatever stands beside it.
std::vector<StepEdge> highest_gradient_edges(const ScanLines& scan);

}  // namespace imprint
