#pragma once

#include <vector>

#include "node/segment/axis_lines.h"

namespace imprint {

/// How bright the body and what lies around it are, column by column, along an axis line.
struct BodyLevels {
  int first_x_px = 0;  ///< the columns over which the body goes on, scale and all
  int last_x_px = -1;
  std::vector<float> body;    ///< one a column of the working image, share of full scale
  std::vector<float> peak;    ///< of the brightest twelfth
  std::vector<float> ground;  ///< of the darker part of both sides
};

/// Levels where `line` runs between two columns, which it takes for the body's.
BodyLevels levels_between(const WorkingImage& working, const AxisLine& line, double width_px, int first_x_px,
                          int last_x_px);

/// Levels along `line` for a body about `width_px` wide, and how far the body reaches to both sides of column
/// `inside_x_px`: until it stays darker than its last brightness by 40 % of its contrast, brighter by 60 % (a jaw,
/// a lamp) or darker than `least_body` for longer than `max_gap_px`.
BodyLevels measure_levels(const WorkingImage& working, const AxisLine& line, double width_px, int inside_x_px,
                          float least_body, double max_gap_px);

}  // namespace imprint
