#pragma once

#include "lib/targets/target_library.h"

namespace imprint::paper {

/// The paper's own greedy choice ([A] 2.1.2): at every step the code of the highest convenience number, the first of
/// equals in ascending order. Made here from the text alone, so that detection is also tried with a library that our
/// generator did not make. 60 codes of 15 bits come out at distance 3, as in the paper.
TargetLibrary greedy_library(int bits, int count);

}  // namespace imprint::paper
