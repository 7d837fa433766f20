#include "lib/targets/target_field.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

std::string trimmed(std::string text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(trimmed(cell));
  return cells;
}

template <class Number>
bool parse(const std::string& text, Number& value) {
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(value)) return false;
  }
  return fault == std::errc{} && end == text.data() + text.size();
}

}  // namespace

Result<TargetField> read_target_field(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  std::istringstream stream(*text);
  std::string line;
  if (!std::getline(stream, line))
    return invalid_input("{}: is empty, expected the header id,x_mm,y_mm,z_mm", path.string());
  const auto header = split(line);
  const std::vector<std::string> wanted{"id", "x_mm", "y_mm", "z_mm"};
  const bool with_sigma = header.size() == 5 && header[4] == "sigma_mm";
  if (header.size() < 4 || !std::equal(wanted.begin(), wanted.end(), header.begin()) ||
      (header.size() > 4 && !with_sigma)) {
    return invalid_input("{}:1: expected the header id,x_mm,y_mm,z_mm[,sigma_mm], found \"{}\"", path.string(),
                         trimmed(line));
  }
  TargetField field;
  for (int number = 2; std::getline(stream, line); ++number) {
    if (trimmed(line).empty()) continue;
    const auto cells = split(line);
    int id = 0;
    FieldTarget target;
    double sigma_mm = 0.0;
    const bool valid = cells.size() == header.size() && parse(cells[0], id) && parse(cells[1], target.p_world_mm.x()) &&
                       parse(cells[2], target.p_world_mm.y()) && parse(cells[3], target.p_world_mm.z()) &&
                       (!with_sigma || (parse(cells[4], sigma_mm) && sigma_mm >= 0.0));
    if (!valid) {
      return invalid_input("{}:{}: expected {} values (a whole number, then finite numbers), found \"{}\"",
                           path.string(), number, header.size(), trimmed(line));
    }
    if (with_sigma) target.sigma_mm = sigma_mm;
    if (!field.targets.emplace(id, target).second) {
      return invalid_input("{}:{}: target id {} stands there twice; each id may be in the field once", path.string(),
                           number, id);
    }
  }
  if (field.targets.empty()) return invalid_input("{}: expected at least one target, found none", path.string());
  return field;
}

Result<void> write_target_field(const TargetField& field, const std::filesystem::path& path) {
  const bool with_sigma = std::any_of(field.targets.begin(), field.targets.end(),
                                      [](const auto& entry) { return entry.second.sigma_mm.has_value(); });
  std::string text = with_sigma ? "id,x_mm,y_mm,z_mm,sigma_mm\n" : "id,x_mm,y_mm,z_mm\n";
  for (const auto& [id, target] : field.targets) {
    const auto& p = target.p_world_mm;
    text += fmt::format("{},{:.6f},{:.6f},{:.6f}", id, p.x(), p.y(), p.z());
    if (with_sigma) text += fmt::format(",{:.6f}", target.sigma_mm.value_or(0.0));
    text += '\n';
  }
  return write_file_atomically(path, text);
}

}  // namespace imprint
