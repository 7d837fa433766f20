#pragma once

#include <vector>

#include "node/edge/edge_config.h"
#include "node/edge/scan_lines.h"

namespace imprint {

/// A peak of the first derivative along a scan line.
struct EdgeCandidate {
  double position_px = 0.0;  ///< along the scan line, to about a quarter px
  double slope = 0.0;        ///< first derivative, share of full scale per px
  double reward = 0.0;       ///< 0 to 1: how far it stands above the noise and how near it comes to the usual strength
  int from_sample = 0;       ///< samples that belong to this edge alone: half way to its neighbours
  int to_sample = 0;
};

/// The edge taken on a scan line.
struct TracedEdge {
  std::size_t line = 0;  ///< index into ScanLines::lines
  EdgeCandidate edge;
};

/// The chain of candidates that follows one rim, by ascending line: Viterbi over all candidates of all lines, with a
/// fixed price for jumps, so that steps stay steps while sparks and marks of a few px do not pull the rim away.
/// `prefer_outermost`: where a weaker edge lies outside a stronger one and the grey level does not fall back to the
/// background between them, the outer one may be the rim and the inner one the border of scale: it counts nearly as
/// much.
std::vector<TracedEdge> trace_rim(const ScanLines& scan, bool prefer_outermost, const EdgeConfig& config);

}  // namespace imprint
