#include "lib/config/yaml_file.h"

#include <charconv>
#include <cmath>
#include <sstream>
#include <utility>

namespace imprint {
namespace {

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t\r") - first + 1));
}

// Up to a # that begins a comment: outside quotes, at the beginning or after a blank.
std::string_view without_comment(std::string_view line) {
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '#' && (i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t')) {
      return line.substr(0, i);
    }
  }
  return line;
}

std::string unquoted(const std::string& text) {
  const bool quoted = text.size() >= 2 && (text.front() == '"' || text.front() == '\'') && text.back() == text.front();
  return quoted ? text.substr(1, text.size() - 2) : text;
}

std::string without_tag(const std::string& text) {
  if (text.empty() || (text.front() != '!' && text.front() != '&')) return text;
  const auto end = text.find(' ');
  return end == std::string::npos ? std::string() : trimmed(std::string_view(text).substr(end));
}

// What stands between the brackets of "[a, b, c]".
std::vector<std::string> list_of(const std::string& text) {
  std::vector<std::string> items;
  std::istringstream stream(text.substr(1, text.size() - 2));
  for (std::string item; std::getline(stream, item, ',');) {
    if (const std::string cleaned = trimmed(item); !cleaned.empty()) items.push_back(unquoted(cleaned));
  }
  return items;
}

std::optional<double> as_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault == std::errc{} && end + 1 == text.data() + text.size() && *end == '.' && std::isfinite(value)) return value;
  if (fault != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

struct OpenKey {
  std::size_t indent;
  std::string path;
};

}  // namespace

Result<YamlFile> YamlFile::parse(std::string_view text, const std::string& name) {
  YamlFile file;
  std::vector<OpenKey> open;
  std::istringstream stream{std::string(text)};
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    const std::string content = trimmed(without_comment(line));
    if (content.empty() || content[0] == '%' || content.starts_with("---") || content == "...") continue;
    const std::size_t indent = line.find_first_not_of(' ');
    if (content.starts_with("- ") && !open.empty()) {
      file.values_[open.back().path].push_back(unquoted(trimmed(std::string_view(content).substr(2))));
      continue;
    }
    while (!open.empty() && open.back().indent >= indent) open.pop_back();
    const auto colon = content.find(':');
    if (colon == std::string::npos || colon == 0)
      return invalid_input("{}:{}: expected \"key: value\", found \"{}\"", name, number, content.substr(0, 60));
    const std::string key = unquoted(trimmed(std::string_view(content).substr(0, colon)));
    const std::string path = open.empty() ? key : open.back().path + "." + key;
    std::string value = without_tag(trimmed(std::string_view(content).substr(colon + 1)));
    const int first_line = number;
    while (!value.empty() && value.front() == '[' && value.back() != ']') {
      if (!std::getline(stream, line))
        return invalid_input("{}:{}: the list of \"{}\" has no end (expected a ])", name, first_line, key);
      ++number;
      value += " " + trimmed(without_comment(line));
    }
    if (value.empty()) {
      open.push_back({indent, path});
    } else if (value.front() == '[') {
      file.values_[path] = list_of(value);
    } else {
      file.values_[path] = {unquoted(value)};
    }
  }
  return file;
}

std::optional<std::string> YamlFile::scalar(const std::string& key) const {
  const auto found = values_.find(key);
  if (found == values_.end() || found->second.size() != 1) return std::nullopt;
  return found->second.front();
}

std::optional<double> YamlFile::number(const std::string& key) const {
  const auto text = scalar(key);
  return text ? as_number(*text) : std::nullopt;
}

std::optional<std::vector<double>> YamlFile::numbers(const std::string& key) const {
  const auto found = values_.find(key);
  if (found == values_.end()) return std::nullopt;
  std::vector<double> numbers;
  for (const std::string& item : found->second) {
    const auto value = as_number(item);
    if (!value) return std::nullopt;
    numbers.push_back(*value);
  }
  return numbers;
}

bool YamlFile::has(const std::string& key) const {
  const auto next = values_.lower_bound(key);
  return next != values_.end() && (next->first == key || next->first.starts_with(key + "."));
}

}  // namespace imprint
