#include "lib/steel/steel.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "lib/config/toml_file.h"
#include "lib/steel/expansion_table.h"

namespace imprint {
namespace {

constexpr double kMmPerM = 1e-3;

std::string plain(std::string_view text) {
  std::string plain;
  for (const char c : text)
    if (!std::isspace(static_cast<unsigned char>(c)))
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return plain;
}

void read_points(TomlReader& read, const toml::table& table, Steel& steel) {
  const toml::array* rows = table["expansion"].as_array();
  if (rows == nullptr || rows->size() < 2) return read.fault("expansion", "expected at least two [C, mm/m]");
  for (const toml::node& row : *rows) {
    const toml::array* pair = row.as_array();
    const auto temperature = pair != nullptr && pair->size() == 2 ? (*pair)[0].value<double>() : std::nullopt;
    const auto expansion = pair != nullptr && pair->size() == 2 ? (*pair)[1].value<double>() : std::nullopt;
    if (!temperature || !expansion || !std::isfinite(*temperature) || !std::isfinite(*expansion))
      return read.fault("expansion", "expected rows [temperature in C, mm/m]");
    if (!steel.points.empty() &&
        (*temperature <= steel.points.back().first || *expansion * kMmPerM < steel.points.back().second))
      return read.fault("expansion", fmt::format("expected ascending rows, found [{}, {}]", *temperature, *expansion));
    steel.points.emplace_back(*temperature, *expansion * kMmPerM);
  }
}

Result<std::vector<Steel>> steels_of(const std::filesystem::path& path, const toml::table& table) {
  TomlReader read(path, table);
  std::vector<Steel> steels;
  for (const toml::table* entry : read.tables("steel")) {
    TomlReader one(path, *entry, fmt::format("steel[{}].", steels.size()));
    Steel steel;
    steel.name = one.string("name");
    steel.grades = one.strings("grades", std::vector<std::string>{});
    steel.source = one.string("source");
    steel.sigma_share = one.number("sigma_share");
    if (!(steel.sigma_share >= 0.0 && steel.sigma_share < 1.0))
      one.fault("sigma_share", fmt::format("expected 0 to 1, found {}", steel.sigma_share));
    read_points(one, *entry, steel);
    if (one.error()) return pass_on(*one.error());
    steels.push_back(std::move(steel));
  }
  if (read.error()) return pass_on(*read.error());
  if (steels.empty()) return invalid_input("{}: expected at least one [[steel]], found none", path.string());
  return steels;
}

double share_at(const Steel& steel, double temperature_c) {
  const auto& points = steel.points;
  auto after = std::ranges::lower_bound(points, temperature_c, {}, &std::pair<double, double>::first);
  if (after == points.begin()) ++after;
  if (after == points.end()) --after;
  const auto& [t0, e0] = *(after - 1);
  const auto& [t1, e1] = *after;
  return e0 + (e1 - e0) * (temperature_c - t0) / (t1 - t0);
}

}  // namespace

Result<std::vector<Steel>> known_steels() {
  try {
    return steels_of("expansion.toml", toml::parse(kExpansionTable));
  } catch (const toml::parse_error& fault) {
    return invalid_input("expansion.toml: {}", fault.description());
  }
}

Result<std::vector<Steel>> read_steels(const std::filesystem::path& path) {
  const auto table = parse_toml_file(path);
  if (!table) return pass_on(table.error());
  return steels_of(path, *table);
}

Result<Steel> find_steel(const std::vector<Steel>& steels, std::string_view name_or_grade) {
  const std::string wanted = plain(name_or_grade);
  std::string known;
  for (const Steel& steel : steels) {
    if (plain(steel.name) == wanted) return steel;
    known += known.empty() ? steel.name : ", " + steel.name;
    for (const std::string& grade : steel.grades) {
      if (plain(grade) == wanted) return steel;
      known += " " + grade;
    }
  }
  return invalid_input("steel \"{}\" is not known; there are: {}", name_or_grade, known);
}

Result<Expansion> expansion_at(const Steel& steel, double temperature_c, double temperature_sigma_c) {
  const double low = steel.points.front().first, high = steel.points.back().first;
  if (!(temperature_c >= low && temperature_c <= high))
    return invalid_input("temperature: {:.0f} to {:.0f} C expected for steel {}, found {}", low, high, steel.name,
                         temperature_c);
  Expansion expansion{.share = share_at(steel, temperature_c)};
  // Over what the temperature may be, not at it alone: the transformation's plateau has no slope.
  const double sigma = std::max(temperature_sigma_c, 0.0);
  const double reach = 0.5 * (share_at(steel, temperature_c + sigma) - share_at(steel, temperature_c - sigma));
  expansion.sigma = std::hypot(steel.sigma_share * expansion.share, reach);
  return expansion;
}

}  // namespace imprint
