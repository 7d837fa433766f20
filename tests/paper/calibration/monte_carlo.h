#pragma once

#include <array>
#include <string>

#include "lib/adjust/calibrate.h"
#include "tests/paper/calibration/check_targets.h"

namespace imprint::paper {

/// What centres of known noise give over many repetitions of the large field: no renderer, no detector.
struct MonteCarlo {
  int repetitions = 0;
  std::array<double, kInteriorTerms> covered{};  ///< share of the 95 % intervals that hold the truth
  double rms_px = 0.0;                           ///< mean reprojection RMS
};
MonteCarlo repeat_calibration(int repetitions, double noise_px);

/// Poses from eight targets at 9 m, the camera known.
struct PoseErrors {
  double median_mm = 0.0, p95_mm = 0.0;
  double interval_mm = 0.0;  ///< mean 95 % half-width, root of the three squared
  double chi2 = 0.0;         ///< mean normalised squared error: 6 where the covariance is honest
  int wrong_pose = 0, wrong_not_listed = 0, right_listed = 0;  ///< with wrong ids only
};
PoseErrors repeat_pose(int repetitions, double noise_px, int targets, int wrong_ids);

/// Check targets in the large field: two cameras calibrated from seven images each, posed by eight targets, 20 others
/// compared; medians over the repetitions. `field_sigma_mm`: error of each coordinate of the field that is used.
CheckErrors repeat_check(int repetitions, double noise_px, double field_sigma_mm);

}  // namespace imprint::paper
