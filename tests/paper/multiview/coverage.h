#pragma once

#include "tests/paper/multiview/measuring.h"

namespace imprint::test {

/// Prints how often the 95 % intervals of the joint estimate hold the truth, over the sections of `forgings` forgings
/// as a forge shows them, and how wide they are beside the errors.
Result<void> print_coverage(int forgings, unsigned seed, const OutOfRound& out_of_round);

}  // namespace imprint::test
