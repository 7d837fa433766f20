#include "fusion/acceptance/nominal.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "lib/config/atomic_file.h"
#include "lib/config/csv_row.h"
#include "lib/config/toml_file.h"

namespace imprint {
namespace {

/// What is wrong with a step, given the one before; empty when nothing is.
std::string fault_of(const NominalStep& step, const NominalStep* before) {
  if (!(step.to_mm > step.from_mm) || !(step.from_mm >= 0.0))
    return fmt::format("expected 0 <= from_mm < to_mm, found {} and {}", step.from_mm, step.to_mm);
  if (!(step.diameter_mm > 0.0)) return fmt::format("diameter_mm: expected more than 0, found {}", step.diameter_mm);
  if (!(step.upper_mm > step.lower_mm))
    return fmt::format("expected lower_mm < upper_mm, found {} and {}", step.lower_mm, step.upper_mm);
  if (step.finish_diameter_mm && !(*step.finish_diameter_mm > 0.0))
    return fmt::format("finish_diameter_mm: expected more than 0, found {}", *step.finish_diameter_mm);
  if (before != nullptr && step.from_mm < before->to_mm)
    return fmt::format("expected from_mm of at least {}, where the step before ends, found {}", before->to_mm,
                       step.from_mm);
  return {};
}

const NominalStep* last_of(const Nominal& nominal) { return nominal.steps.empty() ? nullptr : &nominal.steps.back(); }

/// A mistyped tolerance must not be none.
void refuse_unknown(TomlReader& read, const toml::table& table, std::initializer_list<std::string_view> known) {
  for (const auto& [key, value] : table)
    if (std::ranges::find(known, key.str()) == known.end()) read.fault(key.str(), "unknown key");
}

Result<Nominal> read_toml(const std::filesystem::path& path) {
  const auto table = parse_toml_file(path);
  if (!table) return pass_on(table.error());
  TomlReader read(path, *table);
  refuse_unknown(read, *table, {"name", "cold", "max_deflection_mm", "min_stock_mm", "step"});
  Nominal nominal;
  nominal.name = read.string("name", path.stem().string());
  nominal.cold = read.boolean("cold", false);
  nominal.max_deflection_mm = read.number("max_deflection_mm", 0.0);
  nominal.min_stock_mm = read.number("min_stock_mm", 0.0);
  for (const char* key : {"max_deflection_mm", "min_stock_mm"})
    if (read.number(key, 0.0) < 0.0) read.fault(key, "expected 0 or more");
  for (const toml::table* entry : read.tables("step")) {
    TomlReader one(path, *entry, fmt::format("step[{}].", nominal.steps.size()));
    refuse_unknown(one, *entry,
                   {"name", "from_mm", "to_mm", "diameter_mm", "lower_mm", "upper_mm", "finish_diameter_mm"});
    NominalStep step;
    step.name = one.string("name", fmt::format("step {}", nominal.steps.size() + 1));
    step.from_mm = one.number("from_mm");
    step.to_mm = one.number("to_mm");
    step.diameter_mm = one.number("diameter_mm");
    step.lower_mm = one.number("lower_mm");
    step.upper_mm = one.number("upper_mm");
    if (one.has("finish_diameter_mm")) step.finish_diameter_mm = one.number("finish_diameter_mm");
    if (!one.error())
      if (const std::string fault = fault_of(step, last_of(nominal)); !fault.empty()) one.fault("from_mm", fault);
    if (one.error()) return pass_on(*one.error());
    nominal.steps.push_back(std::move(step));
  }
  if (read.error()) return pass_on(*read.error());
  return nominal;
}

Result<Nominal> read_csv(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  Nominal nominal;
  nominal.name = path.stem().string();
  const std::vector<std::string> expected{"name", "from_mm", "to_mm", "diameter_mm", "lower_mm", "upper_mm"};
  std::istringstream lines(*text);
  std::string line;
  int number = 0;
  bool with_finish = false;
  while (std::getline(lines, line)) {
    ++number;
    if (trimmed(line).empty()) continue;
    const std::vector<std::string> cells = csv_cells(line);
    if (number == 1) {
      with_finish = cells.size() == 7 && cells.back() == "finish_diameter_mm";
      if (cells.size() != expected.size() + (with_finish ? 1 : 0) ||
          !std::equal(expected.begin(), expected.end(), cells.begin()))
        return invalid_input(
            "{}:1: expected the header name,from_mm,to_mm,diameter_mm,lower_mm,upper_mm[,finish_diameter_mm], found {}",
            path.string(), trimmed(line));
      continue;
    }
    NominalStep step;
    double finish = 0.0;
    const auto value = [&](std::size_t i, double& to) { return i < cells.size() && parse_number(cells[i], to); };
    const bool finished = with_finish && cells.size() == 7 && !cells[6].empty();
    if (!value(1, step.from_mm) || !value(2, step.to_mm) || !value(3, step.diameter_mm) || !value(4, step.lower_mm) ||
        !value(5, step.upper_mm) || (finished && !value(6, finish)))
      return invalid_input("{}:{}: expected a name and numbers as the header says, found {}", path.string(), number,
                           trimmed(line));
    step.name = cells[0];
    if (finished) step.finish_diameter_mm = finish;
    if (const std::string fault = fault_of(step, last_of(nominal)); !fault.empty())
      return invalid_input("{}:{}: {}", path.string(), number, fault);
    nominal.steps.push_back(std::move(step));
  }
  return nominal;
}

}  // namespace

Nominal Nominal::grown(double expansion) const {
  Nominal hot = *this;
  hot.max_deflection_mm *= 1.0 + expansion;
  hot.min_stock_mm *= 1.0 + expansion;
  for (NominalStep& step : hot.steps) {
    for (double* length : {&step.from_mm, &step.to_mm, &step.diameter_mm, &step.lower_mm, &step.upper_mm})
      *length *= 1.0 + expansion;
    if (step.finish_diameter_mm) *step.finish_diameter_mm *= 1.0 + expansion;
  }
  return hot;
}

bool Nominal::has_finished_part() const {
  return std::ranges::any_of(steps, [](const NominalStep& step) { return step.finish_diameter_mm.has_value(); });
}

Result<Nominal> read_nominal(const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  if (ending != ".toml" && ending != ".csv")
    return invalid_input("{}: expected a nominal whose name ends in .toml or .csv", path.string());
  auto nominal = ending == ".toml" ? read_toml(path) : read_csv(path);
  if (nominal && nominal->steps.empty())
    return invalid_input("{}: expected at least one step, found none", path.string());
  return nominal;
}

}  // namespace imprint
