#pragma once

#include "lib/targets/target_library.h"

namespace imprint {

/// Sixty 15-bit codes for scenes that name no library: any two differ in at least 4 bits in every rotation and each
/// has at least 6 changes of bit round the ring.
TargetLibrary scene_library();

}  // namespace imprint
