#pragma once

#include <filesystem>

#include "fusion/results/measurement.h"
#include "lib/result/result.h"

namespace imprint {

/// A measurement against the known truth of a simulated forging, section by section at equal s.
struct TruthComparison {
  double length_mm = 0.0;  ///< true values
  double max_deflection_mm = 0.0;
  double diameter_min_mm = 0.0;
  double diameter_max_mm = 0.0;
  double circularity_median_mm = 0.0;
  double axis_rms_mm = 0.0;  ///< of the distance between measured and true axis points
  double axis_max_mm = 0.0;
  double diameter_rms_mm = 0.0;
  double diameter_rms_best90_mm = 0.0;  ///< the largest 10 % of the errors left out, as in [D] table 3
  double circularity_rms_mm = 0.0;
  std::vector<Measurement::Section> sections;  ///< the truth at each measured s; no intervals
  double axis_covered = 0.0;                   ///< share of the sections whose 95 % interval holds the truth
  double diameter_covered = 0.0;
  double circularity_covered = 0.0;
};

/// Reads `truth.json` (docs/scene.md) and compares.
Result<TruthComparison> compare_with_truth(const Measurement& measurement, const std::filesystem::path& truth_file);

nlohmann::json to_json(const TruthComparison& comparison);

}  // namespace imprint
