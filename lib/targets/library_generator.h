#pragma once

#include <cstdint>
#include <vector>

#include "lib/result/result.h"
#include "lib/targets/target_library.h"

namespace imprint {

/// The full library: every cyclic code of `bits` bits once, as its smallest rotation, ascending ([A] 2.1.1; their
/// number is [A] equation 1).
std::vector<std::uint32_t> full_library(int bits);

/// What a generated library reached.
struct GeneratedLibrary {
  TargetLibrary library;
  int least_transitions = 0;  ///< the fewest changes of colour along a ring
};

/// `count` codes of `bits` bits (8 to 20) out of the full library, ids from 1, the codes with the most transitions
/// first. The convenience number C = min(distance, transitions / 2) of [A] equation 4 is made as large as the search
/// can; among those sets the distance, then the least transitions. In place of the paper's greedy choice a tabu search
/// looks for independent sets of the graph whose edges join codes that are too near; the same input always gives the
/// same library. Fails when bits or count are out of range.
Result<GeneratedLibrary> generate_library(int bits, int count);

}  // namespace imprint
