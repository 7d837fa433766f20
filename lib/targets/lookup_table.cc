#include "lib/targets/lookup_table.h"

#include <map>
#include <sstream>

#include "lib/config/atomic_file.h"
#include "lib/targets/code_distance.h"

namespace imprint {
namespace {

/// Two integers of a line and nothing after them.
Result<TargetCode> parse_row(const std::string& line, int bits) {
  std::istringstream row(line);
  long long id = 0;
  long long code = 0;
  std::string rest;
  if (!(row >> id >> code) || row >> rest) return invalid_input("expected a row `id decimal-code`, found \"{}\"", line);
  if (id < 0 || id > 1'000'000'000) return invalid_input("expected an id from 0 to 1000000000, found {}", id);
  if (code < 0 || code >= (1LL << bits)) {
    return invalid_input("expected a code of {} bits, 0 to {}, found {}", bits, (1LL << bits) - 1, code);
  }
  return TargetCode{static_cast<int>(id), static_cast<std::uint32_t>(code)};
}

}  // namespace

Result<TargetLibrary> read_lookup_table(const std::filesystem::path& path, int bits, const TargetGeometry& geometry) {
  if (bits < min_code_bits || bits > max_code_bits) {
    return invalid_input("--bits {}: expected {} to {}", bits, min_code_bits, max_code_bits);
  }
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  TargetLibrary library{bits, 0, geometry, {}};
  std::map<int, int> line_of_id;
  std::map<std::uint32_t, int> line_of_ring;
  std::istringstream lines(*text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    if (line.back() == '\r') line.pop_back();
    const auto row = parse_row(line, bits);
    if (!row) return invalid_input("{}:{}: {}", path.string(), number, row.error().message);
    if (const auto [known, added] = line_of_id.emplace(row->id, number); !added) {
      return invalid_input("{}:{}: id {} is already in line {}", path.string(), number, row->id, known->second);
    }
    if (const auto [known, added] = line_of_ring.emplace(smallest_rotation(row->code, bits), number); !added) {
      return invalid_input("{}:{}: code {} is the ring of line {}, turned", path.string(), number, row->code,
                           known->second);
    }
    library.codes.push_back(*row);
  }
  if (library.codes.empty()) return invalid_input("{}: expected rows `id decimal-code`, found none", path.string());
  library.min_distance = smallest_distance(library.codes, bits);
  return library;
}

}  // namespace imprint
