#pragma once

#include <vector>

#include "node/segment/axis_lines.h"

namespace imprint {

/// A body followed along an axis line: the rim pair of each column where one was seen.
struct BodyPath {
  struct Column {
    int x_px = 0;
    RimPair pair;
  };
  std::vector<Column> columns;  ///< ascending x
  double evidence = 0.0;        ///< sum of the pair weights less the costs of jumps and gaps

  [[nodiscard]] bool empty() const { return columns.empty(); }
  [[nodiscard]] int length_px() const { return empty() ? 0 : columns.back().x_px - columns.front().x_px + 1; }
  [[nodiscard]] double median_width_px() const;
};

/// The best chain of rim pairs near `line` (Viterbi along the columns). Widths may jump (steps of a forging) at a
/// fixed cost, the middle may hardly; interruptions are bridged up to `max_gap_widths` widths where the inside goes on.
BodyPath follow_body(const RimPairs& pairs, const WorkingImage& working, const AxisLine& line, double max_offset_px,
                     double max_gap_widths);

}  // namespace imprint
