#pragma once

#include "tests/paper/multiview/measuring.h"

namespace imprint::test {

/// Prints [D] table 1: `forgings` forgings measured from twelve observations, as a forge shows them, beside a simulated
/// laser scan of each, by the code of `imprint compare`; the paper's figures on top.
Result<void> print_laser_table(int forgings, unsigned seed, const OutOfRound& out_of_round);

}  // namespace imprint::test
