#include "lib/access/schema_list.h"

#include <nlohmann/json.hpp>

#include "lib/config/atomic_file.h"

namespace imprint {

Result<void> read_schema_list(const std::filesystem::path& path, std::string_view schema, std::string_view expected,
                              const std::function<Result<void>(const nlohmann::json&)>& take) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  try {
    const auto document = nlohmann::json::parse(*text);
    const auto& found = document.at("schema");
    if (found != nlohmann::json(schema))
      return invalid_input("{}: schema: expected \"{}\", found {}", path.string(), schema, found.dump());
    if (const auto taken = take(document); !taken) return invalid_input("{}: {}", path.string(), taken.error().message);
    return {};
  } catch (const nlohmann::json::exception& error) {
    return invalid_input("{}: expected {}: {}", path.string(), expected, error.what());
  }
}

}  // namespace imprint
