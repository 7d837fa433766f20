#pragma once

#include <span>
#include <vector>

#include "fusion/combine/joint_start.h"
#include "fusion/faceted/corner_model.h"

namespace imprint {

/// How much the width that a camera sees changes when the forging is turned: the largest of all cameras, as a share.
/// However it is turned, a round forging shows each camera the same width.
double change_of_width(std::span<const std::vector<Imprint>> observations);
/// Above this a forging is looked at for faces.
inline constexpr double kRoundestFaceted = 0.025;

/// All tangents as those of one section of size 1.
struct PooledSection {
  std::vector<double> size_mm;  ///< mean distance of the rims as if all were seen, one a node of the start's axis
  std::vector<SupportSample> samples;
};
PooledSection pooled_section(std::span<const ObservedForging> observations, const JointStart& start);

/// The kind of section that the samples speak for: the one with fewest corners that leaves nearly as little scatter as
/// any; round where harmonics leave as little. A rig that names the kind has the last word.
struct FoundSection {
  SectionKind kind = SectionKind::round;
  CornerFit fit;  ///< of size 1; of a round one empty
};
FoundSection find_section(std::span<const SupportSample> samples, SectionKind told);

}  // namespace imprint
