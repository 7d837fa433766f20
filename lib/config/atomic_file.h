#pragma once

#include <filesystem>
#include <string_view>

#include "lib/result/result.h"

namespace imprint {

/// Writes the whole file or nothing (temporary name beside it, renamed); it is on the disk when this returns. A full or
/// broken disk: job_failed.
Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

/// The bytes of a file; the error names it.
Result<std::string> read_file(const std::filesystem::path& path);

}  // namespace imprint
