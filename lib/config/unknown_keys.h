#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

namespace imprint {

/// Adds a line to `warnings` for each key of `table` that is not among `known`: "<file>:<line>: <prefix><key>: ...".
/// For files that others may add to, where such a key is no fault; it may still be a mistyped one.
void note_unknown_keys(const std::filesystem::path& path, const toml::table& table, std::string_view prefix,
                       std::initializer_list<std::string_view> known, std::vector<std::string>& warnings);

}  // namespace imprint
