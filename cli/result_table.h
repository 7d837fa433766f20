#pragma once

#include <string>

#include "cli/truth_comparison.h"
#include "fusion/results/measurement.h"

namespace imprint {

/// The result for a person at a terminal; with `truth`, the truth and the errors stand beside it. Without the warnings.
std::string result_table(const Measurement& measurement, const TruthComparison* truth = nullptr);

/// The warnings of the result, a line each: why a camera was left out, what is not to be trusted.
std::string warning_lines(const Measurement& measurement);

/// One sentence: how far the sections are from the truth.
std::string truth_text(const Measurement& measurement, const TruthComparison& truth);

/// One sentence: how the cold values come about, with the temperature's source; that they are not known, otherwise.
std::string cold_source(const Measurement& measurement);
/// That sentence and the cold values, a line each.
std::string cold_lines(const Measurement& measurement);

/// One sentence: how much surer all observations are than the first alone.
std::string gain_text(const Measurement::Gain& gain);

}  // namespace imprint
