#pragma once

#include <span>
#include <vector>

#include "node/edge/level_slopes.h"

namespace imprint {

/// How much wider the edge is about each line than the shape it was fitted with, share of that shape's blur: from the
/// residuals of the neighbours `half_lines` to either side together. A rim is as sharp as the rest of its region; where
/// a beam behind or scale before it shows as a strip too thin to be seen as one, two steps pass for a wider one.
/// `lines`: by ascending index. First order, level, step and position of each line being its own.
std::vector<double> blur_excess(std::span<const FittedLine> lines, int half_lines);

}  // namespace imprint
