#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

inline constexpr double kColdC = 20.0;  ///< at which lengths are stated (ISO 1)

/// How steels of some grades grow with heat.
struct Steel {
  std::string name;
  std::vector<std::string> grades;
  std::string source;                             ///< of the table
  double sigma_share = 0.0;                       ///< standard deviation of an expansion, of itself
  std::vector<std::pair<double, double>> points;  ///< temperature in C, relative expansion from 20 C; both ascending
};

/// A share of a length.
struct Expansion {
  double share = 0.0;  ///< by which a length is longer than at 20 C
  double sigma = 0.0;
};

/// The steels of `expansion.toml` beside this file, which every program carries.
Result<std::vector<Steel>> known_steels();
/// The same form from a file of one's own (docs/geometry.md).
Result<std::vector<Steel>> read_steels(const std::filesystem::path& path);

/// The steel of that name, or the one with that grade; capitals and blanks do not matter. Fails (invalid_input) with
/// the names there are.
Result<Steel> find_steel(const std::vector<Steel>& steels, std::string_view name_or_grade);

/// Fails (invalid_input) outside the table.
Result<Expansion> expansion_at(const Steel& steel, double temperature_c, double temperature_sigma_c);

}  // namespace imprint
