#include "survey/scale_bar.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string>

#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

constexpr const char* kHeader = "id_a,id_b,length_mm,sigma_mm";

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(trimmed(cell));
  return cells;
}

template <class Number>
bool parse(const std::string& text, Number& value) {
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  return fault == std::errc{} && end == text.data() + text.size();
}

}  // namespace

Result<std::vector<ScaleBar>> read_scale_bars(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  std::istringstream stream(*text);
  std::string line;
  std::getline(stream, line);
  if (cells_of(line) != cells_of(kHeader))
    return invalid_input("{}:1: expected the header {}, found \"{}\"", path.string(), kHeader, trimmed(line));
  std::vector<ScaleBar> bars;
  for (int number = 2; std::getline(stream, line); ++number) {
    if (trimmed(line).empty()) continue;
    const auto cells = cells_of(line);
    ScaleBar bar;
    const bool valid = cells.size() == 4 && parse(cells[0], bar.id_a) && parse(cells[1], bar.id_b) &&
                       parse(cells[2], bar.length_mm) && parse(cells[3], bar.sigma_mm) &&
                       std::isfinite(bar.length_mm) && std::isfinite(bar.sigma_mm) && bar.length_mm > 0.0 &&
                       bar.sigma_mm > 0.0;
    if (!valid)
      return invalid_input("{}:{}: expected two target ids, a length and its sigma above 0 in mm, found \"{}\"",
                           path.string(), number, trimmed(line));
    if (bar.id_a == bar.id_b)
      return invalid_input("{}:{}: a scale bar joins two targets, found {} twice", path.string(), number, bar.id_a);
    const bool again = std::any_of(bars.begin(), bars.end(), [&](const ScaleBar& other) {
      return std::minmax(other.id_a, other.id_b) == std::minmax(bar.id_a, bar.id_b);
    });
    if (again)
      return invalid_input("{}:{}: the bar from {} to {} stands there twice", path.string(), number, bar.id_a,
                           bar.id_b);
    bars.push_back(bar);
  }
  if (bars.empty()) return invalid_input("{}: expected at least one scale bar, found none", path.string());
  return bars;
}

}  // namespace imprint
