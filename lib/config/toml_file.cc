#include "lib/config/toml_file.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

constexpr std::string_view kOverrideSource = "--set";  // where a value of the command line says it comes from

}  // namespace

Result<toml::table> parse_toml_file(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  try {
    return toml::parse(*text, path.string());
  } catch (const toml::parse_error& error) {
    return invalid_input("{}:{}: not valid TOML: {}", path.string(), error.source().begin.line, error.description());
  }
}

TomlReader::TomlReader(std::filesystem::path path, const toml::table& table, std::string prefix)
    : path_(std::move(path)), table_(table), prefix_(std::move(prefix)) {}

const toml::node* TomlReader::find(std::string_view key) const { return table_.at_path(key).node(); }

bool TomlReader::has(std::string_view key) const { return find(key) != nullptr; }

void TomlReader::fault(std::string_view key, std::string_view message) {
  if (error_) return;  // the first fault is the one to mend first
  const toml::node* node = find(key);
  const auto line = node != nullptr ? node->source().begin.line : table_.source().begin.line;
  const bool from_command_line = node != nullptr && node->source().path && *node->source().path == kOverrideSource;
  const std::string place = from_command_line ? std::string(kOverrideSource)
                            : line > 0        ? fmt::format("{}:{}", path_.string(), line)
                                              : path_.string();
  error_ = Error{ErrorKind::invalid_input, fmt::format("{}: {}{}: {}", place, prefix_, key, message)};
}

std::string TomlReader::string(std::string_view key, std::optional<std::string> fallback) {
  const toml::node* node = find(key);
  if (node == nullptr && fallback) return *fallback;
  if (node != nullptr && node->is_string()) return std::string(node->as_string()->get());
  fault(key, node == nullptr ? "missing, expected a text in quotes" : "expected a text in quotes");
  return {};
}

double TomlReader::number(std::string_view key, std::optional<double> fallback) {
  const toml::node* node = find(key);
  if (node == nullptr && fallback) return *fallback;
  const auto value = node != nullptr && node->is_number() ? node->value<double>() : std::nullopt;
  if (value && std::isfinite(*value)) return *value;
  fault(key, node == nullptr ? "missing, expected a number" : "expected a finite number");
  return 0.0;
}

std::int64_t TomlReader::integer(std::string_view key, std::optional<std::int64_t> fallback) {
  const toml::node* node = find(key);
  if (node == nullptr && fallback) return *fallback;
  if (node != nullptr && node->is_integer()) return node->as_integer()->get();
  fault(key, node == nullptr ? "missing, expected a whole number" : "expected a whole number");
  return 0;
}

bool TomlReader::boolean(std::string_view key, std::optional<bool> fallback) {
  const toml::node* node = find(key);
  if (node == nullptr && fallback) return *fallback;
  if (node != nullptr && node->is_boolean()) return node->as_boolean()->get();
  fault(key, node == nullptr ? "missing, expected true or false" : "expected true or false");
  return false;
}

std::vector<double> TomlReader::numbers(std::string_view key, std::size_t count,
                                        std::optional<std::vector<double>> fallback) {
  const toml::node* node = find(key);
  if (node == nullptr && fallback) return *fallback;
  std::vector<double> values;
  const toml::array* array = node != nullptr ? node->as_array() : nullptr;
  bool valid = array != nullptr && (count == 0 || array->size() == count);
  if (valid) {
    for (const toml::node& element : *array) {
      const auto value = element.is_number() ? element.value<double>() : std::nullopt;
      valid = valid && value && std::isfinite(*value);
      values.push_back(value.value_or(0.0));
    }
  }
  if (!valid) {
    const std::string expected =
        count == 0 ? "a list of finite numbers" : fmt::format("a list of {} finite numbers", count);
    fault(key, (node == nullptr ? "missing, expected " : "expected ") + expected);
    values.assign(count, 0.0);
  }
  return values;
}

std::vector<std::string> TomlReader::strings(std::string_view key, std::optional<std::vector<std::string>> fallback) {
  const toml::node* node = find(key);
  if (node == nullptr && fallback) return *fallback;
  std::vector<std::string> values;
  const toml::array* array = node != nullptr ? node->as_array() : nullptr;
  bool valid = array != nullptr;
  if (valid) {
    for (const toml::node& element : *array) {
      valid = valid && element.is_string();
      if (valid) values.push_back(element.as_string()->get());
    }
  }
  if (!valid) fault(key, node == nullptr ? "missing, expected a list of texts" : "expected a list of texts");
  return valid ? values : std::vector<std::string>{};
}

std::filesystem::path TomlReader::path(std::string_view key, std::optional<std::filesystem::path> fallback) {
  if (!has(key) && fallback) return *fallback;
  const std::string text = string(key);
  if (text.empty() && !error_) fault(key, "expected the path of a file, found an empty text");
  return std::filesystem::absolute(path_).parent_path() / text;
}

std::vector<const toml::table*> TomlReader::tables(std::string_view key) {
  const toml::node* node = find(key);
  std::vector<const toml::table*> result;
  if (node == nullptr) return result;
  const toml::array* array = node->as_array();
  if (array != nullptr) {
    for (const toml::node& element : *array) {
      if (element.is_table()) result.push_back(element.as_table());
    }
  }
  if (array == nullptr || result.size() != array->size()) {
    fault(key, fmt::format("expected tables, each headed [[{}]]", key));
    result.clear();
  }
  return result;
}

void TomlReader::only(std::initializer_list<std::string_view> known) {
  std::string expected;
  for (const std::string_view key : known) expected.append(expected.empty() ? "" : ", ").append(key);
  for (const auto& [section, node] : table_) {
    if (!node.is_table()) {
      fault(section.str(), "unknown key; every key of this file stands in a [section]");
      continue;
    }
    for (const auto& [key, value] : *node.as_table()) {
      const std::string full = fmt::format("{}.{}", section.str(), key.str());
      if (std::ranges::find(known, full) == known.end()) {
        fault(full, "unknown key, expected one of " + expected);
      }
    }
  }
}

Result<void> apply_override(toml::table& table, std::string_view assignment) {
  const auto equals = assignment.find('=');
  const auto dot = assignment.find('.');
  if (equals == std::string_view::npos || dot == std::string_view::npos || dot == 0 || dot + 1 >= equals) {
    return invalid_input("--set {}: expected section.key=value", assignment);
  }
  const std::string section(assignment.substr(0, dot));
  const std::string key(assignment.substr(dot + 1, equals - dot - 1));
  const std::string value(assignment.substr(equals + 1));
  toml::table parsed;
  try {
    parsed = toml::parse("value = " + value, kOverrideSource);
  } catch (const toml::parse_error&) {
    parsed.insert("value", value);  // a bare word is a text
  }
  toml::node* parent = table.get(section);
  if (parent == nullptr) parent = &table.insert(section, toml::table{}).first->second;
  if (!parent->is_table()) return invalid_input("--set {}: \"{}\" is no section of the config", assignment, section);
  parent->as_table()->insert_or_assign(key, std::move(*parsed.get("value")));
  return {};
}

}  // namespace imprint
