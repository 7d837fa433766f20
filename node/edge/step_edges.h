#pragma once

#include <vector>

#include "node/edge/edge_path.h"
#include "node/edge/subpixel.h"

namespace imprint {

/// An edge of one scan line, to subpixel.
struct StepEdge {
  std::size_t line = 0;  ///< index into ScanLines::lines
  double position_px = 0.0;
  double sigma_px = 0.0;
  double step = 0.0;         ///< share of full scale
  double blur_px = 1.0;      ///< standard deviation, where it was fitted
  double blur_excess = 0.0;  ///< how much wider the edge is hereabouts, share of that blur
};

/// How far to either side of a traced edge a step of that blur (px) is fitted, where no other edge is nearer. The
/// farther from the edge, the less does a level hold; where noise (share of the step) is the greater evil, more is
/// read.
int fit_reach_px(double blur_px, double noise_share);

/// Blur and rise of every `region_lines` traced edges, in their order: medians over their lines.
std::vector<EdgeShape> region_shapes(const ScanLines& scan, const std::vector<TracedEdge>& traced,
                                     std::size_t region_lines);

/// Blurred steps fitted to the traced edges. The blur is first fitted freely on a part of the lines, its median taken
/// per `region_lines` lines, then kept: one unknown less for each line. Edges that no step fits are left out.
std::vector<StepEdge> fit_step_edges(const ScanLines& scan, const std::vector<TracedEdge>& traced, int region_lines);

/// Zero crossings of the second derivative at the traced edges.
std::vector<StepEdge> zero_crossing_edges(const ScanLines& scan, const std::vector<TracedEdge>& traced);

/// The sample of the highest gradient of every line, whatever stands beside it.
std::vector<StepEdge> highest_gradient_edges(const ScanLines& scan);

}  // namespace imprint
