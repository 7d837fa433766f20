#pragma once

#include <vector>

#include "node/edge/scan_lines.h"
#include "node/edge/step_edges.h"

namespace imprint {

/// What lies just outside an edge, averaged over its neighbours along the rim, in shares of the edge's step.
/// Outside a silhouette there is background alone; cold scale at the rim hides the true rim and shows as a strip that
/// is darker than the background behind it, or as a faint body of its own.
struct OutsideLevel {
  double dip = 0.0;    ///< how far it falls below the level further out
  double bump = 0.0;   ///< how far it rises above it
  double ledge = 0.0;  ///< how far a strip just inside falls below the level further in: something between both levels
};

/// One an edge, in the order of `edges`; edges whose line does not reach far enough out get zeros.
std::vector<OutsideLevel> outside_levels(const ScanLines& scan, const std::vector<StepEdge>& edges);

}  // namespace imprint
