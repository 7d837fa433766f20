#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/truth_comparison.h"
#include "fusion/results/measurement.h"

namespace imprint {

/// One line of the table of results.
struct ResultRow {
  std::string what;  ///< "length, mm"
  double measured = 0.0;
  double ci95 = 0.0;            ///< half-width; of a largest or smallest value: that of its section. 0: not known
  std::optional<double> truth;  ///< when there is one to compare with
  std::string note{};           ///< where it is, for one that stands at one section
};

/// What a person wants to know first, the same in every report. `measurement` has sections.
std::vector<ResultRow> summarize(const Measurement& measurement, const TruthComparison* truth);

/// The same of the cold forging; nothing where the temperature is not known.
std::vector<ResultRow> cold_rows(const Measurement& measurement);

}  // namespace imprint
