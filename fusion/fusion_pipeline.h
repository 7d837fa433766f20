#pragma once

#include <string>
#include <vector>

#include "fusion/geometry_method.h"
#include "fusion/receive/observation.h"
#include "fusion/results/measurement.h"
#include "lib/result/result.h"
#include "lib/rig/rig.h"

namespace imprint {

/// The whole fusion: triangulate every observation, combine, evaluate. A pure call.
/// Which cameras agree is found alike for either geometry. A camera with a failure or missing is excluded and named in
/// the warnings; fails (job_failed) only when no observation has two usable cameras.
Result<Measurement> fuse(const std::vector<Observation>& observations, const ForgingSpec& forging, std::string session,
                         std::string method, GeometryMethod geometry = GeometryMethod::joint);

}  // namespace imprint
