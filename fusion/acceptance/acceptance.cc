#include "fusion/acceptance/acceptance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "fusion/acceptance/stock.h"

namespace imprint {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Verdict together(Verdict a, Verdict b) {
  if (a == Verdict::fail || b == Verdict::fail) return Verdict::fail;
  return a == Verdict::pass && b == Verdict::pass ? Verdict::pass : Verdict::undecided;
}

Result<StepCheck> check_step(const Measurement& m, const NominalStep& step) {
  // Where one step goes over into the next the diameter is neither's.
  const double margin = std::min(0.1 * (step.to_mm - step.from_mm), 0.5 * step.diameter_mm);
  StepCheck check{
      .name = step.name, .lower_mm = step.diameter_mm + step.lower_mm, .upper_mm = step.diameter_mm + step.upper_mm};
  check.smallest.mm = kInfinity;
  check.largest.mm = -kInfinity;
  check.verdict = Verdict::pass;
  bool any = false;
  for (const Measurement::Section& section : m.sections) {
    if (section.s_mm < step.from_mm + margin || section.s_mm > step.to_mm - margin) continue;
    any = true;
    const Length diameter{section.diameter_mm, section.diameter_ci95_mm};
    if (diameter.mm < check.smallest.mm) check.smallest = diameter, check.smallest_at_mm = section.s_mm;
    if (diameter.mm > check.largest.mm) check.largest = diameter, check.largest_at_mm = section.s_mm;
    check.verdict = together(check.verdict, decide(diameter, check.lower_mm, check.upper_mm));
  }
  if (!any)
    return invalid_input(
        "nominal: {} from {:.0f} to {:.0f} mm lies on no section of the forging, which is {:.0f} mm long", step.name,
        step.from_mm, step.to_mm, m.length_mm);
  return check;
}

/// The sections of the forging under the finished part, when that begins `shift_mm` from the first end.
std::vector<StockSection> under_part(const Measurement& m, const ForgingShape& shape, const Nominal& nominal,
                                     double shift_mm) {
  std::vector<StockSection> sections;
  for (std::size_t i = 0; i < m.sections.size(); ++i) {
    double radius = 0.0;  // at a step's end both parts count
    for (const NominalStep& step : nominal.steps)
      if (step.finish_diameter_mm && m.sections[i].s_mm >= step.from_mm + shift_mm &&
          m.sections[i].s_mm <= step.to_mm + shift_mm)
        radius = std::max(radius, 0.5 * *step.finish_diameter_mm);
    if (radius > 0.0) sections.push_back({m.sections[i].s_mm, &shape[i], radius});
  }
  return sections;
}

std::optional<StockCheck> check_stock(const Measurement& m, const Nominal& nominal) {
  if (!nominal.has_finished_part() || m.shape.size() != m.sections.size()) return std::nullopt;
  // Along the forging the part may lie wherever there is room, in steps of a hundredth of it.
  const double room = m.length_mm - nominal.steps.back().to_mm;
  StockCheck check{.wanted_mm = nominal.min_stock_mm};
  check.least.mm = -kInfinity;
  PartAxis best;
  for (int i = 0; i <= (room > 0.0 ? 20 : 0); ++i) {
    const double shift = room > 0.0 ? room * i / 20.0 : 0.0;
    const auto sections = under_part(m, m.shape, nominal, shift);
    if (sections.empty()) continue;
    const PartAxis axis = best_part_axis(sections);
    const LeastStock least = least_stock(sections, axis);
    if (least.mm <= check.least.mm) continue;
    check.least.mm = least.mm;
    check.least_at_mm = least.s_mm;
    check.direction_deg = std::remainder(least.direction_rad, 2.0 * M_PI) * 180.0 / M_PI;
    check.shift_mm = shift;
    best = axis;
  }
  if (!std::isfinite(check.least.mm)) return std::nullopt;
  const Eigen::Vector2d first = best.at(0.0), last = best.at(m.length_mm);
  check.y_first_mm = first.x(), check.z_first_mm = first.y();
  check.y_last_mm = last.x(), check.z_last_mm = last.y();
  double squares = 0.0;
  for (const ForgingShape& draw : m.draws)
    squares += std::pow(least_stock(under_part(m, draw, nominal, check.shift_mm), best).mm - check.least.mm, 2);
  if (!m.draws.empty()) check.least.ci95_mm = 1.959964 * std::sqrt(squares / static_cast<double>(m.draws.size()));
  if (room < 0.0) {
    check.verdict = Verdict::fail;  // longer than the forging
  } else {
    check.verdict = decide(check.least, nominal.min_stock_mm, kInfinity);
  }
  return check;
}

}  // namespace

std::string_view name_of(Verdict verdict) {
  static constexpr std::array<std::string_view, 3> kNames{"pass", "fail", "undecided"};
  return kNames[static_cast<std::size_t>(verdict)];
}

Verdict decide(const Length& value, double lower, double upper) {
  if (value.mm - value.ci95_mm >= lower && value.mm + value.ci95_mm <= upper) return Verdict::pass;
  if (value.mm + value.ci95_mm < lower || value.mm - value.ci95_mm > upper) return Verdict::fail;
  return Verdict::undecided;
}

Result<Acceptance> accept(const Measurement& m, const Nominal& nominal) {
  if (m.sections.empty()) return job_failed("a result without sections cannot be held against a nominal");
  if (nominal.cold && !m.cooling)
    return invalid_input("nominal {} is of the cold part: --steel and --temperature-c are needed", nominal.name);
  const Nominal hot = nominal.cold ? nominal.grown(m.cooling->expansion.share) : nominal;
  Acceptance acceptance{.nominal = nominal.name, .steps = {}, .verdict = Verdict::pass};
  for (const NominalStep& step : hot.steps) {
    auto check = check_step(m, step);
    if (!check) return pass_on(check.error());
    acceptance.verdict = together(acceptance.verdict, check->verdict);
    acceptance.steps.push_back(std::move(*check));
  }
  if (hot.max_deflection_mm > 0.0) {
    acceptance.straightness = decide(m.straightness.max_deflection, -kInfinity, hot.max_deflection_mm);
    acceptance.verdict = together(acceptance.verdict, *acceptance.straightness);
  }
  acceptance.stock = check_stock(m, hot);
  if (acceptance.stock) acceptance.verdict = together(acceptance.verdict, acceptance.stock->verdict);
  return acceptance;
}

nlohmann::json to_json(const Acceptance& a) {
  nlohmann::json json = {{"nominal", a.nominal}, {"verdict", name_of(a.verdict)}, {"steps", nlohmann::json::array()}};
  for (const StepCheck& step : a.steps)
    json["steps"].push_back({{"name", step.name},
                             {"lower_mm", step.lower_mm},
                             {"upper_mm", step.upper_mm},
                             {"min_mm", step.smallest.mm},
                             {"min_ci95_mm", step.smallest.ci95_mm},
                             {"min_at_mm", step.smallest_at_mm},
                             {"max_mm", step.largest.mm},
                             {"max_ci95_mm", step.largest.ci95_mm},
                             {"max_at_mm", step.largest_at_mm},
                             {"verdict", name_of(step.verdict)}});
  if (a.straightness) json["straightness"] = {{"verdict", name_of(*a.straightness)}};
  if (a.stock) {
    const StockCheck& stock = *a.stock;
    json["stock"] = {{"least_mm", stock.least.mm},
                     {"least_ci95_mm", stock.least.ci95_mm},
                     {"least_at_mm", stock.least_at_mm},
                     {"direction_deg", stock.direction_deg},
                     {"wanted_mm", stock.wanted_mm},
                     {"shift_mm", stock.shift_mm},
                     {"first_mm", {stock.y_first_mm, stock.z_first_mm}},
                     {"last_mm", {stock.y_last_mm, stock.z_last_mm}},
                     {"fits", stock.least.mm >= 0.0},
                     {"verdict", name_of(stock.verdict)}};
  }
  return json;
}

}  // namespace imprint
