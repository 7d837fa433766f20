#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

/// Radii of a ring-coded target, all in one unit (only the ratios to the dot radius matter).
struct TargetGeometry {
  double dot_radius = 1.0;
  double ring_inner_radius = 2.0;
  double ring_outer_radius = 3.0;
};

struct TargetCode {
  int id = 0;
  std::uint32_t code = 0;  ///< cyclic; bit (bits - 1) is read first, clockwise as seen; 1 = white
};

/// The coded targets that exist at a site; `library.json` of the contract.
struct TargetLibrary {
  int bits = 15;
  int min_distance = 0;  ///< smallest rotation-invariant Hamming distance between two codes, [A] equation 3
  TargetGeometry geometry;
  std::vector<TargetCode> codes;
};

/// Reads and checks `library.json`: schema, code length, unique ids and codes, distance as stated.
Result<TargetLibrary> read_target_library(const std::filesystem::path& path);

Result<void> write_target_library(const TargetLibrary& library, const std::filesystem::path& path);

}  // namespace imprint
