#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "fusion/results/measurement.h"

namespace imprint {

struct ReadResult {
  Measurement measurement;  ///< with sections
  nlohmann::json document;  ///< the file's own, with what this program does not know of
};

/// Reads `result.json`. Fails (invalid_input) naming the file.
Result<ReadResult> read_result_file(const std::filesystem::path& path);

}  // namespace imprint
