#pragma once

#include <vector>

#include "fusion/combine/combine.h"

namespace imprint {

/// A length with the half-width of its 95 % interval; 0: not known.
struct Length {
  double mm = 0.0;
  double ci95_mm = 0.0;
};

/// How straight the axis is, seen from the ideal axis where nothing else is said.
struct Straightness {
  Length max_deflection;
  double max_deflection_at_mm = 0.0;
  double max_deflection_direction_deg = 0.0;  ///< of (y, z), from y towards z
  Length total_indicator;  ///< what an indicator moves at most while the forging turns once about its ideal axis
  Length per_metre;        ///< bow of the axis over any 1000 mm (over its length, when it is shorter)
  Length minimum_zone;     ///< diameter of the narrowest cylinder that holds the axis, ISO 12780-1
};

/// The mean's interval is that of the sections that are seen. Largest and smallest stand with the interval of their
/// section: that of an extreme would tell of the least known.
struct Diameters {
  Length mean, smallest, largest;
  double smallest_at_mm = 0.0, largest_at_mm = 0.0;
};

/// One section's deviation from round, ISO 12181-1 (fusion/results/roundness.h).
struct SectionRoundness {
  Length least_squares, minimum_zone, minimum_circumscribed;
};

Straightness evaluate_straightness(const CombinedForging& forging);
Diameters evaluate_diameters(const CombinedForging& forging);
/// One a section; none where the sections' shapes are not known.
std::vector<SectionRoundness> evaluate_roundness(const CombinedForging& forging);

}  // namespace imprint
