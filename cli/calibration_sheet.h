#pragma once

#include <string>
#include <vector>

#include "lib/adjust/calibrate.h"

namespace imprint {

/// What the record of a calibration shows beside the calibration itself.
struct CalibrationSheet {
  const Calibration& calibration;
  const std::vector<CalibrationImage>& images;
  const TargetField& field;
  std::string field_name;
  std::string made_at;  ///< UTC
};

/// The residuals as vectors over the image, and their radial profile: a PNG.
Result<std::string> draw_residuals_png(const CalibrationSheet& sheet);

/// The record on A4: constants with 95 % intervals, the same plots, every image, what was left out and why, warnings
/// and the correlations between the constants: a PDF.
Result<std::string> draw_record_pdf(const CalibrationSheet& sheet);

}  // namespace imprint
