#pragma once

#include <vector>

#include "node/segment/axis_lines.h"

namespace imprint {

/// How bright the body and what lies around it are, column by column, along an axis line.
struct BodyLevels {
  int first_x_px = 0;  ///< the columns over which the body goes on, scale and all
  int last_x_px = -1;
  int inside_x_px = 0;        ///< a column that surely is the body's
  std::vector<float> body;    ///< one a column of the working image, share of full scale
  std::vector<float> ground;  ///< of the darker part of both sides
};

/// Levels where `line` runs between two columns, which it takes for the body's.
BodyLevels levels_between(const WorkingImage& working, const AxisLine& line, double width_px, int first_x_px,
                          int last_x_px);

/// Levels along `line` for a body about `width_px` wide, and how far the body reaches to both sides of column
/// `inside_x_px`: where its columns, scaled or not, speak for it most. What looks different for longer than
/// `max_gap_px` ends it.
BodyLevels measure_levels(const WorkingImage& working, const AxisLine& line, double width_px, int inside_x_px,
                          float least_body, double max_gap_px);

}  // namespace imprint
