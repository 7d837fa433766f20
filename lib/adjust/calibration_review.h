#pragma once

#include <string>
#include <vector>

#include "lib/adjust/calibrate.h"

namespace imprint {

/// Standard deviations of the targets seen along their three main directions, over the largest of them; descending.
/// (1, 0, 0) for targets on a line, (1, b, 0) for a flat field.
Eigen::Vector3d field_extents(const std::vector<CalibrationImage>& images, const TargetField& field);

/// What the images do not tell apart, one line each with what to add: constants that go together, constants with wide
/// intervals, and the arrangements that lead there (all images alike; a flat field seen from one side).
std::vector<std::string> separation_warnings(const Calibration& calibration,
                                             const std::vector<CalibrationImage>& images, const TargetField& field,
                                             const CalibrateConfig& config);

/// Why a target was left out, as far as the others tell: one that fits nowhere has moved, one far off has another's id.
std::string rejection_reason(const Calibration& calibration, const CalibrationResidual& residual);

}  // namespace imprint
