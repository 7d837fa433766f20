#pragma once

#include <vector>

#include "node/segment/axis_lines.h"

namespace imprint {

/// How bright the body and what lies around it are, column by column, along an axis line.
struct BodyLevels {
  int first_x_px = 0;  ///< the columns over which the body goes on, scale and all
  int last_x_px = -1;
  std::vector<float> body;    ///< one a column of the working image, share of full scale
  std::vector<float> ground;  ///< of the darker part of both sides
};

/// Levels along `line` for a body about `width_px` wide, and how far the body reaches to both sides of column
/// `inside_x_px`: until it stays darker than 60 % of its last brightness, or than `least_body`, for longer than
/// `max_gap_px`.
BodyLevels measure_levels(const WorkingImage& working, const AxisLine& line, double width_px, int inside_x_px,
                          float least_body, double max_gap_px);

/// Where the body's brightness ends on both sides, for each of its columns: rough, but there where a rim has no edge of
/// its own. Weights are 0.
std::vector<RimPair> rims_by_brightness(const WorkingImage& working, const AxisLine& line, const BodyLevels& levels,
                                        double width_px);

/// Pairs weighed by what the levels say: a rim's inner side is as bright as the body there, which the edge of a beam
/// behind it is not, and its outer side is darker. Pairs outside the body's columns go.
RimPairs weigh_by_levels(const RimPairs& pairs, const WorkingImage& working, const BodyLevels& levels);

}  // namespace imprint
