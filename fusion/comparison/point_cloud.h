#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include "lib/result/result.h"

namespace imprint {

/// The points of a laser scan in mm, `scale` times what the file holds (1000: metres). By the file's ending: PLY
/// (ASCII or binary, either byte order; only x, y and z of its vertices are read) or XYZ (`.xyz`, `.txt`, `.asc`,
/// `.csv`: three numbers a line, more are ignored, as are lines that begin with # or //, and one header line). Points
/// that are not finite are dropped. Fails (invalid_input) naming the file and the line or what the header lacks.
Result<std::vector<Eigen::Vector3d>> read_point_cloud(const std::filesystem::path& path, double scale = 1.0);

}  // namespace imprint
