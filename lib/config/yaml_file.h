#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

/// The part of YAML that calibration files are written in: nested block mappings of scalars and lists of scalars.
/// Keys are joined by dots; tags, anchors, comments and document marks are passed over.
class YamlFile {
 public:
  /// Fails (invalid_input) with the line of what is no such YAML. `name`: for messages.
  static Result<YamlFile> parse(std::string_view text, const std::string& name);

  [[nodiscard]] std::optional<std::string> scalar(const std::string& key) const;
  [[nodiscard]] std::optional<double> number(const std::string& key) const;
  /// Nothing when the key is missing or holds something that is no finite number.
  [[nodiscard]] std::optional<std::vector<double>> numbers(const std::string& key) const;
  /// Whether anything stands at or below `key`.
  [[nodiscard]] bool has(const std::string& key) const;

 private:
  std::map<std::string, std::vector<std::string>> values_;
};

}  // namespace imprint
