#pragma once

#include "lib/result/result.h"

namespace imprint {

/// How rims are validated and filtered. Windows count stations (px along the axis).
struct FilterConfig {
  int rim_window = 10;               // weighted parabola of the rims, [C] 2.3.2
  int axis_window = 40;              // weighted parabola of the axis, [C] 2.3.2
  int max_region_gap = 10;           // a longer gap parts regions; ours
  double max_region_jump_px = 3.0;   // a larger jump parts regions; ours
  int min_region_length = 8;         // shorter regions are invalid; ours
  double min_region_strength = 0.2;  // mean magnitude over that of the whole rim; ours

  int best_rim_window = 20;          // of `best`; its weights let it be wider than [C]'s without bending at steps; ours
  int best_axis_window = 40;         // ours
  int step_window = 10;              // stations on either side that decide whether the rim steps; ours
  double min_step_px = 0.7;          // smaller steps are smoothed over; ours
  double min_kink = 0.12;            // change of a rim's slope that ends a stretch, px per station; ours
  int agreement_window = 240;        // over which the middle of the rims is smooth; ours
  int min_trusted_run = 18;          // stations; shorter trusted stretches of a rim are not trusted; ours
  double min_disagreement_px = 0.5;  // of the middle, from which the rim further in is not trusted; ours

  double min_coverage = 0.04;  // share of the length with both rims trusted; ours
  int min_points = 50;         // of each rim; ours

  [[nodiscard]] Result<void> validate() const;
};

}  // namespace imprint
