#include "cli/result_summary.h"

#include <algorithm>

#include <fmt/core.h>

namespace imprint {
namespace {

using Section = Measurement::Section;

double median_of(const Measurement& m, double Section::*value) {
  std::vector<double> values;
  for (const auto& section : m.sections) values.push_back(section.*value);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string place(const Section& section) { return fmt::format("at {:.0f} mm from the first end", section.s_mm); }

}  // namespace

std::vector<ResultRow> summarize(const Measurement& m, const TruthComparison* truth) {
  const auto known = [truth](double TruthComparison::*value) {
    return truth != nullptr ? std::optional(truth->*value) : std::nullopt;
  };
  const auto& bent = *std::ranges::max_element(m.sections, {}, &Section::deflection_mm);
  const auto [thin, thick] = std::ranges::minmax_element(m.sections, {}, &Section::diameter_mm);
  return {{"length, mm", m.length_mm, m.length_ci95_mm, known(&TruthComparison::length_mm)},
          {"largest deflection, mm", m.max_deflection_mm, bent.axis_ci95_mm, known(&TruthComparison::max_deflection_mm),
           fmt::format("at {:.0f} mm from the first end, direction {:.0f} deg (from +y to +z)", m.max_deflection_at_mm,
                       m.max_deflection_direction_deg)},
          {"smallest diameter, mm", thin->diameter_mm, thin->diameter_ci95_mm, known(&TruthComparison::diameter_min_mm),
           place(*thin)},
          {"largest diameter, mm", thick->diameter_mm, thick->diameter_ci95_mm,
           known(&TruthComparison::diameter_max_mm), place(*thick)},
          {"median circularity, mm", median_of(m, &Section::circularity_mm),
           median_of(m, &Section::circularity_ci95_mm), known(&TruthComparison::circularity_median_mm)}};
}

}  // namespace imprint
