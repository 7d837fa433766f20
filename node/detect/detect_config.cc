#include "node/detect/detect_config.h"

namespace imprint {

Result<void> DetectConfig::validate() const {
  if (!(min_dot_px >= 2.0 && min_dot_px <= 1000.0)) {
    return invalid_input("min_dot_px: expected 2 to 1000, found {}", min_dot_px);
  }
  if (!(max_dot_px >= min_dot_px && max_dot_px <= 2000.0)) {
    return invalid_input("max_dot_px: expected {} (min_dot_px) to 2000, found {}", min_dot_px, max_dot_px);
  }
  if (!(max_axis_ratio >= 1.0)) return invalid_input("max_axis_ratio: expected at least 1, found {}", max_axis_ratio);
  if (!(min_contrast > 0.0)) return invalid_input("min_contrast: expected more than 0, found {}", min_contrast);
  if (!(max_residual > 0.0)) return invalid_input("max_residual: expected more than 0, found {}", max_residual);
  if (!(max_unknown >= 0.0 && max_unknown < 1.0)) {
    return invalid_input("max_unknown: expected 0 to below 1, found {}", max_unknown);
  }
  if (max_candidates_per_tile < 1) {
    return invalid_input("max_candidates_per_tile: expected at least 1, found {}", max_candidates_per_tile);
  }
  return {};
}

}  // namespace imprint
