#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "cli/truth_comparison.h"
#include "fusion/results/measurement.h"

namespace imprint {

/// The report for paper and archive: one HTML page that needs nothing from elsewhere and no script, laid out for A4;
/// well-formed as XML too. It shows the results with their intervals, the warnings, the plots and the cameras, and
/// carries `document`, the result as it was in its file, in <script id="result" type="application/json">.
/// `measurement` has sections.
std::string report_page(const Measurement& measurement, const nlohmann::json& document,
                        const TruthComparison* truth = nullptr);

}  // namespace imprint
