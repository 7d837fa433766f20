#pragma once

#include "lib/result/result.h"

namespace imprint {

/// How edges are found on the scan lines.
struct EdgeConfig {
  double search_outward_px = 22.0;  // from the expected rim away from the body: rim scale hides the true rim; ours
  double search_inward_px = 40.0;   // into the body; ours
  double scan_spacing_px = 0.5;     // of the paper's methods, [C] 2.3.2
  double min_peak_width_px = 1.0;   // narrowest peak of the first derivative taken as an edge; ours
  double peak_noise_factor = 4.5;   // its height in standard deviations of the derivative's noise; ours
  int smoothing_stations = 5;       // along the rim, for telling edges from noise only; ours
  double smoothing_sigma_px = 1.0;  // across the rim, likewise; ours
  int max_candidates = 6;           // edges a scan line, the strongest; ours
  double jump_cost = 6.0;           // of leaving one edge for another, in well-seen stations; ours
  double outermost_share = 0.85;    // least worth of a body's outermost edge, share of the strongest's; ours
  double detached_share = 0.8;      // worth of an edge behind which the level falls back to the background; ours
  int max_gap_stations = 300;       // longest stretch without edge that a rim is followed across; ours
  int blur_region_stations = 256;   // the blur is taken as constant over this length; ours
  double end_half_band = 0.35;      // rows on either side of the axis for the ends, share of the diameter; ours
  double end_search_px = 24.0;      // about the coarse end; ours
  double end_haze_share = 0.5;      // of the haze that the rims show, by which an end may be off; ours

  [[nodiscard]] Result<void> validate() const;
};

}  // namespace imprint
