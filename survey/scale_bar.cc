#include "survey/scale_bar.h"

#include <algorithm>
#include <sstream>
#include <string>

#include "lib/config/atomic_file.h"
#include "lib/config/csv_row.h"

namespace imprint {
namespace {

constexpr const char* kHeader = "id_a,id_b,length_mm,sigma_mm";

}  // namespace

Result<std::vector<ScaleBar>> read_scale_bars(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  std::istringstream stream(*text);
  std::string line;
  std::getline(stream, line);
  if (csv_cells(line) != csv_cells(kHeader))
    return invalid_input("{}:1: expected the header {}, found \"{}\"", path.string(), kHeader, trimmed(line));
  std::vector<ScaleBar> bars;
  for (int number = 2; std::getline(stream, line); ++number) {
    if (trimmed(line).empty()) continue;
    const auto cells = csv_cells(line);
    ScaleBar bar;
    const bool valid = cells.size() == 4 && parse_number(cells[0], bar.id_a) && parse_number(cells[1], bar.id_b) &&
                       parse_number(cells[2], bar.length_mm) && parse_number(cells[3], bar.sigma_mm) &&
                       bar.length_mm > 0.0 && bar.sigma_mm > 0.0;
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
