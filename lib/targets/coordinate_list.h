#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lib/result/result.h"
#include "lib/targets/target_field.h"

namespace imprint {

/// How another program's coordinate list is laid out.
struct CoordinateListFormat {
  std::string columns = "id,x,y,z";  ///< names of its columns in their order: id, x, y, z, sigma; any other is skipped
  int skip_lines = 0;                ///< before the first row
  double mm_per_unit = 1.0;
};

/// A field from rows of columns divided by commas, semicolons, tabs or blanks. Empty lines and those that begin with #
/// are skipped; columns beyond those named are ignored. Fails (invalid_input), naming the line, on a row that is too
/// short or holds no number where one is wanted, and on an id that stands there twice (naming both lines).
Result<TargetField> read_coordinate_list(const std::filesystem::path& path, const CoordinateListFormat& format);

}  // namespace imprint
