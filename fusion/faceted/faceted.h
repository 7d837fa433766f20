#pragma once

#include <span>

#include "fusion/combine/combine.h"
#include "fusion/combine/combine_config.h"

namespace imprint {

/// `combine` for forgings whose sections have faces. The observations are triangulated with
/// `TriangulateConfig::kFacetedShare`. `told`: the kind of section, or unknown. With `section_kind` round in what comes
/// back nothing else is in it: the tangents show no faces. The axis runs through the middles of the corners.
/// Fails as `combine` does.
Result<CombinedForging> combine_faceted(std::span<const ObservedForging> observations,
                                        std::span<const double> rotations_deg, const ForgingSpec& forging,
                                        SectionKind told, const CombineConfig& config);

}  // namespace imprint
