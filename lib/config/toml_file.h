#pragma once

#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include "lib/result/result.h"

namespace imprint {

/// Reads one TOML file. Errors name the file and the line.
Result<toml::table> parse_toml_file(const std::filesystem::path& path);

/// Reads values of one table and collects what is wrong, so that a file's reader is a list of plain lines:
///   TomlReader read(path, table);
///   config.width_px = read.integer("camera.width_px");
///   if (auto error = read.error()) return pass_on(*error);
/// Keys are dotted paths. A getter with a default takes it only when the key is absent.
class TomlReader {
 public:
  TomlReader(std::filesystem::path path, const toml::table& table, std::string prefix = "");

  std::string string(std::string_view key, std::optional<std::string> fallback = std::nullopt);
  double number(std::string_view key, std::optional<double> fallback = std::nullopt);
  std::int64_t integer(std::string_view key, std::optional<std::int64_t> fallback = std::nullopt);
  bool boolean(std::string_view key, std::optional<bool> fallback = std::nullopt);
  /// `count` numbers; 0 takes any count.
  std::vector<double> numbers(std::string_view key, std::size_t count,
                              std::optional<std::vector<double>> fallback = std::nullopt);
  /// A list of texts.
  std::vector<std::string> strings(std::string_view key,
                                   std::optional<std::vector<std::string>> fallback = std::nullopt);
  /// A path, made absolute against the file's folder.
  std::filesystem::path path(std::string_view key, std::optional<std::filesystem::path> fallback = std::nullopt);
  /// The tables of an array of tables (`[[camera]]`); empty when the key is absent.
  std::vector<const toml::table*> tables(std::string_view key);
  [[nodiscard]] bool has(std::string_view key) const;
  /// Faults every `section.key` that is not among `known`: a mistyped key must not be a default unnoticed.
  void only(std::initializer_list<std::string_view> known);

  /// Notes a fault of one key: "<file>:<line>: <prefix><key>: <message>".
  void fault(std::string_view key, std::string_view message);
  [[nodiscard]] std::optional<Error> error() const { return error_; }

 private:
  const toml::node* find(std::string_view key) const;
  std::filesystem::path path_;
  const toml::table& table_;
  std::string prefix_;
  std::optional<Error> error_;
};

/// Applies `section.key=value` (the value in TOML syntax, a bare word is a string) over a table.
Result<void> apply_override(toml::table& table, std::string_view assignment);

}  // namespace imprint
