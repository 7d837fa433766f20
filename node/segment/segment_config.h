#pragma once

#include "lib/result/result.h"

namespace imprint {

/// How the forging is looked for; lengths "reduced" are in px of the reduced image.
struct SegmentConfig {
  int max_reduction = 4;                  // the image is shrunk by at most this; [C] takes 2, 4 suits 16 Mpx
  double min_reduced_diameter_px = 18.0;  // the narrowest forging keeps at least this width; ours
  double smoothing_sigma_px = 0.5;        // of the 3 x 3 Gaussian, [C] 2.3.2
  double weak_noise_factor = 5.0;         // magW in standard deviations of the gradient's noise; ours
  double strong_noise_factor = 9.0;       // magS, likewise; ours
  double strong_angle_deg = 20.0;         // dirS: rim's direction against the prior; ours
  double weak_angle_deg = 40.0;           // dirW; ours
  int min_rim_run_px = 9;                 // length of the opening along the axis, reduced; ours
  double max_tilt_deg = 32.0;             // forging against the prior direction; ours
  double turn_step_deg = 8.0;             // between the directions that the filter is turned to; ours
  int directions_followed = 3;            // of those, after a first look; ours
  int max_rims_per_column = 12;           // of each kind, the strongest; ours
  int axis_candidates = 24;               // Hough lines looked into; ours
  double max_axis_bow = 0.25;             // axis from a straight line, share of the smallest diameter; ours
  double min_elongation = 2.0;            // seen length over diameter that makes a forging; ours
  double half_elongation = 1.5;           // length over diameter that counts one half; ours
  double center_reach = 0.35;             // off the image's middle by this share of its shorter side counts half; ours
  double faint_contrast = 0.01;           // body over ground that counts one half, share of full scale; ours
  double min_body_level = 0.28;           // of a section, share of the body's usual level over the background; ours
  double min_score = 0.6;                 // less is no forging; ours
  double max_gap_diameters = 0.8;         // longest interruption bridged, in local diameters; ours

  [[nodiscard]] Result<void> validate() const;
};

}  // namespace imprint
