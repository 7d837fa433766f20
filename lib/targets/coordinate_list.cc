#include "lib/targets/coordinate_list.h"

#include <algorithm>
#include <map>
#include <optional>
#include <sstream>

#include "lib/config/atomic_file.h"
#include "lib/config/csv_row.h"

namespace imprint {
namespace {

// Where each wanted column stands.
struct Columns {
  std::size_t id = 0, x = 0, y = 0, z = 0, least = 0;
  std::optional<std::size_t> sigma;
};

Result<Columns> find_columns(const std::string& text) {
  const auto names = csv_cells(text);
  Columns columns;
  const auto place = [&](const char* name) -> std::optional<std::size_t> {
    const auto it = std::find(names.begin(), names.end(), name);
    if (it == names.end() || std::find(it + 1, names.end(), name) != names.end()) return std::nullopt;
    columns.least = std::max(columns.least, static_cast<std::size_t>(it - names.begin()) + 1);
    return static_cast<std::size_t>(it - names.begin());
  };
  const auto id = place("id"), x = place("x"), y = place("y"), z = place("z");
  if (!id || !x || !y || !z || std::count(names.begin(), names.end(), "sigma") > 1)
    return invalid_input("--columns: expected id, x, y and z once each, and sigma at most once, found \"{}\"", text);
  columns.id = *id;
  columns.x = *x;
  columns.y = *y;
  columns.z = *z;
  columns.sigma = place("sigma");
  return columns;
}

// A comma or semicolon divides where there is one; else blanks do.
std::vector<std::string> cells_of(std::string line) {
  std::replace(line.begin(), line.end(), ';', ',');
  if (line.find(',') != std::string::npos) return csv_cells(line);
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; stream >> cell;) cells.push_back(cell);
  return cells;
}

}  // namespace

Result<TargetField> read_coordinate_list(const std::filesystem::path& path, const CoordinateListFormat& format) {
  if (!(format.mm_per_unit > 0.0) || format.skip_lines < 0)
    return invalid_input("coordinate list: mm_per_unit above 0 and skip_lines of at least 0 expected");
  const auto columns = find_columns(format.columns);
  if (!columns) return pass_on(columns.error());
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  TargetField field;
  std::map<int, int> first_line;
  std::istringstream stream(*text);
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    if (number <= format.skip_lines || trimmed(line).empty() || trimmed(line).front() == '#') continue;
    const auto cells = cells_of(trimmed(line));
    if (cells.size() < columns->least)
      return invalid_input(
          "{}:{}: expected at least {} columns ({}), found {}: \"{}\"; --skip-lines leaves out a header", path.string(),
          number, columns->least, format.columns, cells.size(), trimmed(line));
    int id = 0;
    Eigen::Vector3d p;
    double sigma = 0.0;
    const auto number_in = [&](std::size_t column, auto& value) { return parse_number(cells[column], value); };
    const bool valid = number_in(columns->id, id) && number_in(columns->x, p.x()) && number_in(columns->y, p.y()) &&
                       number_in(columns->z, p.z()) &&
                       (!columns->sigma || (number_in(*columns->sigma, sigma) && sigma >= 0.0));
    if (!valid)
      return invalid_input(
          "{}:{}: expected a whole number as id and finite numbers in the columns {}, found \"{}\"; --skip-lines "
          "leaves "
          "out a header",
          path.string(), number, format.columns, trimmed(line));
    const auto [it, fresh] = first_line.emplace(id, number);
    if (!fresh)
      return invalid_input("{}:{}: target id {} stands there twice, first in line {}", path.string(), number, id,
                           it->second);
    FieldTarget target{format.mm_per_unit * p, std::nullopt};
    if (columns->sigma) target.sigma_mm = format.mm_per_unit * sigma;
    field.targets[id] = target;
  }
  if (field.targets.empty()) return invalid_input("{}: expected at least one row, found none", path.string());
  return field;
}

}  // namespace imprint
