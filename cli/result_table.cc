#include "cli/result_table.h"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

namespace imprint {
namespace {

struct Summary {
  double diameter_min_mm, diameter_max_mm, circularity_median_mm, axis_ci95_mm, diameter_ci95_mm;
};

double median_of(const Measurement& m, double Measurement::Section::*value) {
  std::vector<double> values;
  for (const auto& section : m.sections) values.push_back(section.*value);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Summary summarize(const Measurement& m) {
  const auto [smallest, largest] = std::minmax_element(
      m.sections.begin(), m.sections.end(), [](const auto& a, const auto& b) { return a.diameter_mm < b.diameter_mm; });
  return {smallest->diameter_mm, largest->diameter_mm, median_of(m, &Measurement::Section::circularity_mm),
          median_of(m, &Measurement::Section::axis_ci95_mm), median_of(m, &Measurement::Section::diameter_ci95_mm)};
}

std::string row(const char* what, double measured, const TruthComparison* truth, double TruthComparison::*value) {
  std::string line = fmt::format("  {:<26} {:>10.2f}", what, measured);
  if (truth != nullptr) line += fmt::format(" {:>10.2f} {:>+9.2f}", truth->*value, measured - truth->*value);
  return line + "\n";
}

}  // namespace

std::string result_table(const Measurement& m, const TruthComparison* truth) {
  const Summary summary = summarize(m);
  std::string text = fmt::format("Forging \"{}\", {} observation{}, method {}\n", m.session, m.observations.size(),
                                 m.observations.size() == 1 ? "" : "s", m.method);
  text += fmt::format("  {:<26} {:>10}", "", "measured");
  text += truth != nullptr ? fmt::format(" {:>10} {:>9}\n", "truth", "error") : "\n";
  text += row("length, mm", m.length_mm, truth, &TruthComparison::length_mm);
  text += row("largest deflection, mm", m.max_deflection_mm, truth, &TruthComparison::max_deflection_mm);
  text += fmt::format("    at {:.0f} mm from the first end, direction {:.0f} deg\n", m.max_deflection_at_mm,
                      m.max_deflection_direction_deg);
  text += row("smallest diameter, mm", summary.diameter_min_mm, truth, &TruthComparison::diameter_min_mm);
  text += row("largest diameter, mm", summary.diameter_max_mm, truth, &TruthComparison::diameter_max_mm);
  text += row("median circularity, mm", summary.circularity_median_mm, truth, &TruthComparison::circularity_median_mm);
  text += fmt::format("  95 % intervals (median): axis +-{:.2f} mm, diameter +-{:.2f} mm\n", summary.axis_ci95_mm,
                      summary.diameter_ci95_mm);
  if (truth != nullptr) {
    text += fmt::format(
        "  Against the truth, {} sections: axis RMS {:.3f} mm (largest {:.2f}); diameter RMS {:.3f} mm (best 90 %: "
        "{:.3f}); "
        "circularity RMS {:.3f} mm\n",
        m.sections.size(), truth->axis_rms_mm, truth->axis_max_mm, truth->diameter_rms_mm,
        truth->diameter_rms_best90_mm, truth->circularity_rms_mm);
  }
  for (const auto& observation : m.observations) {
    text += fmt::format("  observation {} at {:.1f} deg:", observation.index, observation.rotation_deg);
    for (const auto& camera : observation.cameras) {
      text += camera.excluded ? fmt::format("  {} LEFT OUT", camera.id)
                              : fmt::format("  {} {} targets {:.3f} px", camera.id, camera.targets_used,
                                            camera.reprojection_rms_px);
    }
    text += "\n";
  }
  return text;
}

}  // namespace imprint
