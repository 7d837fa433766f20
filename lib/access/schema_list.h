#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "lib/result/result.h"

namespace imprint {

/// Reads the JSON document in a file and gives it to `take`, which may throw what nlohmann throws. Fails
/// (invalid_input) naming the file when it is no JSON, its "schema" is not `schema`, or `take` fails or throws: then
/// with `expected`, what the file should have been.
Result<void> read_schema_list(const std::filesystem::path& path, std::string_view schema, std::string_view expected,
                              const std::function<Result<void>(const nlohmann::json&)>& take);

}  // namespace imprint
