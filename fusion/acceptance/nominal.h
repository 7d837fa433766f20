#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

/// One step of the part as it is wanted, from the first end.
struct NominalStep {
  std::string name;
  double from_mm = 0.0, to_mm = 0.0;
  double diameter_mm = 0.0;                  ///< the forging's
  double lower_mm = 0.0, upper_mm = 0.0;     ///< limits of its deviation from that
  std::optional<double> finish_diameter_mm;  ///< of the part turned from it
};

/// What is wanted, at the temperature it was measured at unless `cold`.
struct Nominal {
  std::string name;
  bool cold = false;               ///< lengths are at 20 C
  double max_deflection_mm = 0.0;  ///< 0: no limit
  double min_stock_mm = 0.0;       ///< on the radius, over the finished part
  std::vector<NominalStep> steps;  ///< ascending, not overlapping

  /// Of a forging longer by `expansion` (a share): the same part hot.
  [[nodiscard]] Nominal grown(double expansion) const;
  [[nodiscard]] bool has_finished_part() const;
};

/// A stepped nominal from TOML (`[[step]]`) or CSV (header `name,from_mm,to_mm,diameter_mm,lower_mm,upper_mm` and
/// optionally `finish_diameter_mm`), by the file's ending; docs/geometry.md. Fails (invalid_input) naming the file and
/// the key or line.
Result<Nominal> read_nominal(const std::filesystem::path& path);

}  // namespace imprint
