#include "lib/config/unknown_keys.h"

#include <algorithm>

#include <fmt/format.h>

namespace imprint {

void note_unknown_keys(const std::filesystem::path& path, const toml::table& table, std::string_view prefix,
                       std::initializer_list<std::string_view> known, std::vector<std::string>& warnings) {
  std::string expected;
  for (const std::string_view key : known) expected.append(expected.empty() ? "" : ", ").append(key);
  for (const auto& [key, node] : table) {
    if (std::ranges::find(known, key.str()) != known.end()) continue;
    warnings.push_back(fmt::format("{}:{}: {}{}: unknown key, passed over; known are {}", path.string(),
                                   node.source().begin.line, prefix, key.str(), expected));
  }
}

}  // namespace imprint
