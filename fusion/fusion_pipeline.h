#pragma once

#include <string>
#include <vector>

#include "fusion/results/measurement.h"
#include "lib/imprint/imprint.h"
#include "lib/result/result.h"
#include "lib/rig/rig.h"

namespace imprint {

/// One observation as it reached fusion: an imprint a camera; cameras that never reported stand in `missing`.
struct Observation {
  int index = 0;
  double rotation_deg = 0.0;
  std::vector<Imprint> imprints;
  std::vector<std::pair<std::string, std::string>> missing;  ///< camera id, why
};

/// The whole fusion: triangulate every observation, combine, evaluate. A pure call.
/// A camera with a failure or missing is excluded and named in the warnings; fails (job_failed)
/// only when no observation has two usable cameras.
Result<Measurement> fuse(const std::vector<Observation>& observations, const ForgingSpec& forging,
                         std::string session, std::string method);

}  // namespace imprint
