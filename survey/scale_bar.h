#pragma once

#include <filesystem>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

/// A known distance between the centres of two coded targets.
struct ScaleBar {
  int id_a = 0, id_b = 0;
  double length_mm = 0.0;
  double sigma_mm = 0.0;  ///< standard deviation of the length as its certificate states it
};

/// Reads `bars.csv`: header `id_a,id_b,length_mm,sigma_mm`, one bar a row. Names the line of a bar that is there twice,
/// joins a target with itself, or has a length or sigma that is not above 0.
Result<std::vector<ScaleBar>> read_scale_bars(const std::filesystem::path& path);

}  // namespace imprint
