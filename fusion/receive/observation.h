#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "lib/imprint/imprint.h"

namespace imprint {

/// A node's clock minus fusion's.
struct ClockOffset {
  std::int64_t offset_ns = 0;
  std::int64_t uncertainty_ns = 0;  ///< half the way there and back
};

/// One observation as it reached fusion: an imprint a camera; cameras that never reported stand in `missing`.
struct Observation {
  int index = 0;
  double rotation_deg = 0.0;
  std::vector<Imprint> imprints;
  std::vector<std::pair<std::string, std::string>> missing;  ///< camera id, why
};

}  // namespace imprint
