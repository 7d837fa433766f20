#pragma once

#include "node/edge/locate_edges.h"

namespace imprint {

/// How hot air moves the rims, px: the RMS of an edge point about the chord between those a fifth of the diameter on
/// either side, less the noise that neighbours do not share. Robust against shoulders; dents of the steel and scale
/// that moves edges are in it too. 0: nothing beyond the noise, or too few points.
double rim_haze_px(const Silhouette& silhouette);

}  // namespace imprint
