#pragma once

#include <vector>

#include "lib/camera/dot_disc.h"
#include "survey/network.h"

namespace imprint {

/// The discs of all targets of an adjusted network that four or more sights show: radius and normal with which the mean
/// diameters seen agree best. Sights without a diameter count for nothing.
DotDiscs find_dot_discs(const Network& network, const std::vector<Sight>& sights);

/// Takes the eccentricity out of every sight whose target's disc is known.
void correct_eccentricity(const Network& network, std::vector<Sight>& sights);

}  // namespace imprint
