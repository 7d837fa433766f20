#include "cli/result_file.h"

#include "lib/config/atomic_file.h"

namespace imprint {

Result<ReadResult> read_result_file(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  try {
    auto document = nlohmann::json::parse(*text);
    auto measurement = measurement_from_json(document);
    if (!measurement) return invalid_input("{}: {}", path.string(), measurement.error().message);
    if (measurement->sections.empty())
      return invalid_input("{}: expected a result with sections, found none", path.string());
    return ReadResult{std::move(*measurement), std::move(document)};
  } catch (const nlohmann::json::exception& error) {
    return invalid_input("{}: not a result file: {}", path.string(), error.what());
  }
}

}  // namespace imprint
