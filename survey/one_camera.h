#pragma once

#include <string>
#include <vector>

#include "survey/network.h"

namespace imprint {

/// How much longer one photograph's focal length is than the network's, from its own sights.
struct FocalDeviation {
  std::size_t photo = 0;
  double share = 0.0;
  double sigma = 0.0;
};

/// Of every photograph of an adjusted network that shows at least six of its targets, robustly.
std::vector<FocalDeviation> focal_deviations(const Network& network, const std::vector<Sight>& sights);

/// The photographs of the smaller group when the focal lengths fall into two that are more than `max_spread` apart for
/// certain: of two cameras, or of one whose focus or zoom was changed. Empty when they are of one.
std::vector<std::size_t> other_camera(const std::vector<FocalDeviation>& deviations, double max_spread);

}  // namespace imprint
