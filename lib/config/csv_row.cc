#include "lib/config/csv_row.h"

namespace imprint {

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t\r") - first + 1));
}

std::vector<std::string> csv_cells(const std::string& line) {
  std::vector<std::string> cells;
  std::size_t from = 0;
  for (std::size_t comma = line.find(','); comma != std::string::npos; comma = line.find(',', from)) {
    cells.push_back(trimmed(std::string_view(line).substr(from, comma - from)));
    from = comma + 1;
  }
  cells.push_back(trimmed(std::string_view(line).substr(from)));
  return cells;
}

}  // namespace imprint
