#pragma once

#include <span>
#include <string>
#include <vector>

#include "fusion/triangulate/end_planes.h"
#include "fusion/triangulate/rod_consensus.h"
#include "fusion/triangulate/triangulate.h"

namespace imprint {

/// The ends of one observation.
struct RodEnds {
  EndPlanes planes;
  std::vector<EndReading> readings;   ///< those believed
  std::vector<std::string> warnings;  ///< for the operator
};

/// Both ends by vote of the cameras that read them: the largest group of readings that agree is believed. Where none
/// agree the one nearest to where the rims stop is, and its interval reaches to the others; an end nobody saw lies
/// where the rims stop. `ids` by CameraView::camera; `out_of_round_share` as for `agree_on_rod`.
RodEnds find_ends(std::span<const CameraView> views, const RodConsensus& rod, std::span<const std::string> ids,
                  double end_section_mm, double out_of_round_share);

}  // namespace imprint
