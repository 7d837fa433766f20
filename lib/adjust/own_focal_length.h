#pragma once

#include <array>
#include <optional>
#include <vector>

#include "lib/adjust/calibrate.h"
#include "lib/adjust/collinearity_error.h"

namespace imprint {

/// A target's centre in the image in question, and where the target stands.
struct CentreSeen {
  CollinearityError error;
  std::array<double, 3> p_world_mm;
};

struct OwnFocalLength {
  double value_px = 0.0;
  double sigma_px = 0.0;
};

/// The focal length that one image shows by itself, robustly, pose and focal length free and the other constants as
/// given (the start values are those of Ceres' parameters, see CollinearityError); nothing where it cannot tell.
std::optional<OwnFocalLength> own_focal_length(std::array<double, kInteriorTerms> interior, std::array<double, 3> turn,
                                               std::array<double, 3> center, const std::vector<CentreSeen>& centres);

}  // namespace imprint
