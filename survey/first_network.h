#pragma once

#include <vector>

#include "lib/result/result.h"
#include "survey/network.h"

namespace imprint {

struct FirstNetworkConfig {
  double rough_share = 0.015;  ///< of half the shorter side: what a sight may be off before the lens is known (ours)
  double fine_px = 2.0;        ///< what it may be off afterwards (ours)
  double min_angle_deg = 4.0;  ///< at which two rays must meet to give a target (ours)
  int min_common = 6;          ///< targets of a starting pair (ours)
  int pairs_to_try = 8;        ///< ours
  double settled_share = 0.9;  ///< of the sights that must fit before no further pair is tried (ours)
};

/// The sights of all photographs, in their order.
std::vector<Sight> sights_of(const std::vector<SurveyPhoto>& photos, double noise_floor_px);

/// Start values for the adjustment from the sights alone: a pair of photographs with many common targets and a wide
/// base, oriented to each other; then, photograph by photograph, resection on the targets known so far, intersection
/// of new ones and adjustment, the lens let free as soon as there are photographs enough. Several pairs, and where the
/// focal length is not known several of those, are tried until the sights agree.
/// `camera`: size and, where `focal_known`, focal length; the rest as its maker states it.
/// Fails (job_failed) when no two photographs can be oriented to each other.
Result<Network> first_network(const CameraModel& camera, bool focal_known, std::size_t photos,
                              const std::vector<Sight>& sights, const FirstNetworkConfig& config);

}  // namespace imprint
