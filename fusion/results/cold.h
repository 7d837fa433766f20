#pragma once

#include <string>

#include "fusion/results/evaluation.h"
#include "lib/steel/steel.h"

namespace imprint {

/// How hot the forging was, and who says so.
struct HotState {
  double temperature_c = 0.0;
  double temperature_sigma_c = 0.0;
  std::string source;  ///< of the temperature: "pyrometer 2", "entered by hand"
};

/// The way from the hot forging to the cold one, alike in all directions.
struct Cooling {
  std::string grade;  ///< as asked for
  std::string steel;
  std::string expansion_source;
  HotState hot;
  Expansion expansion;

  /// A length of the hot forging at 20 C.
  [[nodiscard]] Length cold(const Length& hot_length) const;
};

/// Fails (invalid_input) when the grade is not known or the temperature lies outside its table.
Result<Cooling> cooling_of(const std::vector<Steel>& steels, const std::string& grade, const HotState& hot);

}  // namespace imprint
