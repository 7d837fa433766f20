#include "cli/result_table.h"

#include <fmt/core.h>

#include "cli/result_summary.h"

namespace imprint {
namespace {

std::string table_row(const ResultRow& row) {
  std::string line = fmt::format("  {:<26} {:>10.2f}", row.what, row.measured);
  line += row.ci95 > 0.0 ? fmt::format(" {:>8.2f}", row.ci95) : fmt::format(" {:>8}", "");
  if (row.truth) line += fmt::format(" {:>10.2f} {:>+9.2f}", *row.truth, row.measured - *row.truth);
  while (line.ends_with(' ')) line.pop_back();
  if (!row.note.empty()) line += "\n    " + row.note;
  return line + "\n";
}

}  // namespace

std::string truth_text(const Measurement& m, const TruthComparison& truth) {
  return fmt::format(
      "Against the truth, {} sections: axis RMS {:.3f} mm (largest {:.2f}); diameter RMS {:.3f} mm (best 90 %: "
      "{:.3f}); "
      "circularity RMS {:.3f} mm",
      m.sections.size(), truth.axis_rms_mm, truth.axis_max_mm, truth.diameter_rms_mm, truth.diameter_rms_best90_mm,
      truth.circularity_rms_mm);
}

std::string gain_text(const Measurement::Gain& gain) {
  return fmt::format(
      "{} observations together, the first alone: axis +-{:.2f} for +-{:.2f} mm, diameter +-{:.2f} for +-{:.2f} mm, "
      "circularity +-{:.2f} for +-{:.2f} mm (95 %, median section)",
      gain.observations, gain.all.axis_ci95_mm, gain.first_alone.axis_ci95_mm, gain.all.diameter_ci95_mm,
      gain.first_alone.diameter_ci95_mm, gain.all.circularity_ci95_mm, gain.first_alone.circularity_ci95_mm);
}

std::string cold_source(const Measurement& m) {
  if (!m.cooling)
    return "All values are of the forging as hot as it was; its temperature is not known, so neither are the cold ones";
  const Cooling& c = *m.cooling;
  return fmt::format(
      "Cold, at {:.0f} C: {} ({}) shrinks by {:.3f} % from {:.0f} +- {:.0f} C (95 %, temperature: {}); expansion after "
      "{}",
      kColdC, c.grade, c.steel, 100.0 * (1.0 - 1.0 / (1.0 + c.expansion.share)), c.hot.temperature_c,
      1.96 * c.hot.temperature_sigma_c, c.hot.source, c.expansion_source);
}

std::string cold_lines(const Measurement& m) {
  std::string text = "  " + cold_source(m) + "\n";
  for (const ResultRow& row : cold_rows(m)) text += table_row(row);
  return text;
}

std::string result_table(const Measurement& m, const TruthComparison* truth) {
  std::string text = fmt::format("Forging \"{}\", {} observation{}, method {}\n", m.session, m.observations.size(),
                                 m.observations.size() == 1 ? "" : "s", m.method);
  text += fmt::format("  {:<26} {:>10} {:>8}", "", "measured", "+-95 %");
  text += truth != nullptr ? fmt::format(" {:>10} {:>9}\n", "truth", "error") : "\n";
  for (const ResultRow& row : summarize(m, truth)) text += table_row(row);
  if (truth != nullptr) text += "  " + truth_text(m, *truth) + "\n";
  text += cold_lines(m);
  if (m.gain.observations > 0) text += "  " + gain_text(m.gain) + "\n";
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

std::string warning_lines(const Measurement& m) {
  std::string text;
  for (const std::string& warning : m.warnings) text += fmt::format("  warning: {}\n", warning);
  return text;
}

}  // namespace imprint
