#pragma once

#include <string>

#include "cli/truth_comparison.h"
#include "fusion/results/measurement.h"

namespace imprint {

/// The result for a person at a terminal; with `truth`, the truth and the errors stand beside it.
std::string result_table(const Measurement& measurement, const TruthComparison* truth = nullptr);

/// One sentence: how far the sections are from the truth.
std::string truth_text(const Measurement& measurement, const TruthComparison& truth);

}  // namespace imprint
