#pragma once

#include <vector>

#include "node/segment/rim_candidates.h"

namespace imprint {

/// A straight axis in the working image: y = y0_px + slope (x - x0_px).
struct AxisLine {
  double x0_px = 0.0;
  double y0_px = 0.0;
  double slope = 0.0;
  double votes = 0.0;

  [[nodiscard]] double y_px(double x_px) const { return y0_px + slope * (x_px - x0_px); }
};

/// Two rims of one column that could bound the forging.
struct RimPair {
  float upper_px = 0;
  float lower_px = 0;
  float weight = 0;  ///< 0 to 1: strength of both rims, how well the inside is brighter than the outside, and contrast
  float body = 0;    ///< upper quartile of the grey levels inside: scale may darken most of a section
  float step = 0;    ///< the lower of the grey level steps at both rims, share of full scale

  bool both = true;  ///< false: one rim was seen, the other is its mirror image about the axis

  [[nodiscard]] float width_px() const { return lower_px - upper_px; }
  [[nodiscard]] float middle_px() const { return 0.5F * (upper_px + lower_px); }
};

/// The rim pairs of every column, and the range of widths they were allowed.
struct RimPairs {
  std::vector<std::vector<RimPair>> columns;
  double min_width_px = 0.0;
  double max_width_px = 0.0;
  float half_step = 0.0F;  ///< step whose contrast counts one half, share of full scale
};

/// The pairs of each column whose distance is between the limits (virtual axis points of [C] 2.3.2). Contrast counts
/// against that of the image's strongest pairs and only softly: clutter may be brighter than the forging.
RimPairs pair_rims(const WorkingImage& working, const RimCandidates& rims, double min_width_px, double max_width_px);

/// The pairs near a known axis and, where scale or clutter hides one rim, lighter ones of the other rim and its mirror
/// image. Pairs whose inside is not at least `least_body` bright are left out. At most `max_count` a column.
RimPairs pairs_about_axis(const RimPairs& pairs, const WorkingImage& working, const RimCandidates& rims,
                          const AxisLine& line, double max_offset_px, float least_body, int max_count);

/// The lines with the most votes, by descending votes, apart by at least `separation_px` (Hough, [C] 2.3.2).
/// A column gives one vote to a line however many pairs it has there.
std::vector<AxisLine> vote_axis_lines(const RimPairs& pairs, int height_px, double separation_px,
                                      const SegmentConfig& config);

}  // namespace imprint
