#pragma once

#include <filesystem>

#include "lib/result/result.h"
#include "lib/targets/target_library.h"

namespace imprint {

/// A library from a foreign table with rows `id decimal-code` (white bit = 1, clockwise from the highest bit; the code
/// is cyclic, so that the bit it begins with does not matter). Empty lines and lines that begin with # are skipped.
/// Its distance is worked out. Errors name the file and line: no two integers, a code too large for `bits`, an id that
/// is there already, or a code that is another id's ring turned.
Result<TargetLibrary> read_lookup_table(const std::filesystem::path& path, int bits, const TargetGeometry& geometry);

}  // namespace imprint
