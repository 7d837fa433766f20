#include "cli/result_summary.h"

#include <algorithm>

#include <fmt/core.h>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

using Section = Measurement::Section;

double median_of(const Measurement& m, double Section::*value) {
  std::vector<double> values;
  for (const auto& section : m.sections) values.push_back(section.*value);
  return median(std::move(values));
}

std::string place(const Section& section) { return fmt::format("at {:.0f} mm from the first end", section.s_mm); }

}  // namespace

std::vector<ResultRow> summarize(const Measurement& m, const TruthComparison* truth) {
  const auto known = [truth](double TruthComparison::*value) {
    return truth != nullptr ? std::optional(truth->*value) : std::nullopt;
  };
  const auto& bent = *std::ranges::max_element(m.sections, {}, &Section::deflection_mm);
  const auto [thin, thick] = std::ranges::minmax_element(m.sections, {}, &Section::diameter_mm);
  std::vector<ResultRow> rows = {
      {"length, mm", m.length_mm, m.length_ci95_mm, known(&TruthComparison::length_mm)},
      {"largest deflection, mm", m.max_deflection_mm, bent.axis_ci95_mm, known(&TruthComparison::max_deflection_mm),
       fmt::format("at {:.0f} mm from the first end, direction {:.0f} deg (from +y to +z)", m.max_deflection_at_mm,
                   m.max_deflection_direction_deg)},
      {"smallest diameter, mm", thin->diameter_mm, thin->diameter_ci95_mm, known(&TruthComparison::diameter_min_mm),
       place(*thin)},
      {"largest diameter, mm", thick->diameter_mm, thick->diameter_ci95_mm, known(&TruthComparison::diameter_max_mm),
       place(*thick)},
      {"median circularity, mm", median_of(m, &Section::circularity_mm), median_of(m, &Section::circularity_ci95_mm),
       known(&TruthComparison::circularity_median_mm)}};
  const auto add = [&rows](std::string what, const Length& length, std::string note = {}) {
    rows.push_back({std::move(what), length.mm, length.ci95_mm, std::nullopt, std::move(note)});
  };
  if (m.diameters.mean.mm > 0.0) {  // a result of before these were measured has none
    rows[1].ci95 = m.straightness.max_deflection.ci95_mm > 0.0 ? m.straightness.max_deflection.ci95_mm : rows[1].ci95;
    add("mean diameter, mm", m.diameters.mean);
    add("straightness, mm", m.straightness.minimum_zone, "narrowest cylinder around the axis (ISO 12780)");
    add("bow over 1 m, mm", m.straightness.per_metre);
    add("total indicator, mm", m.straightness.total_indicator, "turned about the ideal axis, out-of-round included");
  }
  if (!m.roundness.empty()) {
    const auto largest = [&](Length SectionRoundness::*kind) {
      const auto worst =
          std::ranges::max_element(m.roundness, {}, [&](const SectionRoundness& r) { return (r.*kind).mm; });
      return std::pair(*worst.*kind, place(m.sections[static_cast<std::size_t>(worst - m.roundness.begin())]));
    };
    const auto [least_squares, at_ls] = largest(&SectionRoundness::least_squares);
    add("roundness LS, mm", least_squares, "largest (ISO 12181), " + at_ls);
    const auto [zone, at_mz] = largest(&SectionRoundness::minimum_zone);
    add("roundness MZ, mm", zone, "largest (ISO 12181), " + at_mz);
    const auto [around, at_mc] = largest(&SectionRoundness::minimum_circumscribed);
    add("roundness MC, mm", around, "largest (ISO 12181), " + at_mc);
  }
  for (const Measurement::Station& station : m.stations) {
    const Section section = section_at(m, station.s_mm);
    add(fmt::format("diameter at {}, mm", station.name), {section.diameter_mm, section.diameter_ci95_mm},
        place(section));
  }
  return rows;
}

std::vector<ResultRow> cold_rows(const Measurement& m) {
  std::vector<ResultRow> rows;
  if (!m.cooling) return rows;
  const auto add = [&](std::string what, const Length& hot) {
    const Length cold = m.cooling->cold(hot);
    rows.push_back({std::move(what), cold.mm, cold.ci95_mm, std::nullopt, {}});
  };
  add("cold length, mm", {m.length_mm, m.length_ci95_mm});
  add("cold deflection, mm", m.straightness.max_deflection);
  add("cold mean diameter, mm", m.diameters.mean);
  add("cold smallest diameter, mm", m.diameters.smallest);
  add("cold largest diameter, mm", m.diameters.largest);
  for (const Measurement::Station& station : m.stations) {
    const Section section = section_at(m, station.s_mm);
    add(fmt::format("cold diameter at {}, mm", station.name), {section.diameter_mm, section.diameter_ci95_mm});
  }
  return rows;
}

}  // namespace imprint
