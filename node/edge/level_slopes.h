#pragma once

#include <span>
#include <vector>

#include "node/edge/subpixel.h"

namespace imprint {

/// A step of known shape as it was fitted to the values of one line across a rim.
struct FittedLine {
  int index = 0;  ///< neighbours along the rim have indices 1 apart
  const float* values = nullptr;
  int count = 0;
  StepFit fit;
  EdgeShape shape;
};

/// What to add to the position of each line's fit, since the levels on both sides of a rim are not even: the light of a
/// body falls off towards scale and the cooler surface beside it, a halo towards the background. Both slopes are found
/// from the residuals of the neighbours `half_lines` to either side together; lines that their step does not fit count
/// less. `lines`: by ascending index. First order: the fit's own linearisation.
std::vector<double> shifts_by_slopes(std::span<const FittedLine> lines, int half_lines);

}  // namespace imprint
