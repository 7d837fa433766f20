#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "fusion/results/cold.h"

namespace imprint {

/// What a person says of the forging's heat: of --steel, --temperature-c and what belongs to them.
struct HotOptions {
  std::string grade;
  double temperature_c = 0.0;
  double temperature_sigma_c = 20.0;
  std::string source = "entered by hand";
  std::filesystem::path steels;  ///< a table of one's own; empty: the known steels
};

void add_hot_options(CLI::App& command, HotOptions& options);

/// The cooling they describe; nothing without a steel. Fails (invalid_input) for what is not known or outside its
/// table.
Result<std::optional<Cooling>> cooling_from(const HotOptions& options);

}  // namespace imprint
