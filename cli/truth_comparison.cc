#include "cli/truth_comparison.h"

#include <algorithm>
#include <cmath>

#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

struct TrueSection {
  double s_mm, y_mm, z_mm, diameter_mm, circularity_mm;
};

TrueSection interpolate(const std::vector<TrueSection>& sections, double s_mm) {
  const auto after = std::lower_bound(sections.begin(), sections.end(), s_mm,
                                      [](const TrueSection& section, double s) { return section.s_mm < s; });
  if (after == sections.begin()) return sections.front();
  if (after == sections.end()) return sections.back();
  const TrueSection &a = *(after - 1), &b = *after;
  const double t = (s_mm - a.s_mm) / (b.s_mm - a.s_mm);
  const auto mix = [t](double x, double y) { return x + t * (y - x); };
  return {s_mm, mix(a.y_mm, b.y_mm), mix(a.z_mm, b.z_mm), mix(a.diameter_mm, b.diameter_mm),
          mix(a.circularity_mm, b.circularity_mm)};
}

double rms(const std::vector<double>& errors, double share = 1.0) {
  std::vector<double> squares;
  for (const double error : errors) squares.push_back(error * error);
  std::sort(squares.begin(), squares.end());
  const auto count = static_cast<std::size_t>(std::ceil(share * static_cast<double>(squares.size())));
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) sum += squares[i];
  return std::sqrt(sum / static_cast<double>(count));
}

double covered(const std::vector<double>& errors, const std::vector<double>& halfwidths) {
  std::size_t inside = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) inside += std::abs(errors[i]) <= halfwidths[i] ? 1 : 0;
  return static_cast<double>(inside) / static_cast<double>(errors.size());
}

std::vector<TrueSection> read_sections(const nlohmann::json& truth) {
  std::vector<TrueSection> sections;
  for (const auto& section : truth.at("sections")) {
    const auto& axis = section.at("axis_mm");
    sections.push_back({section.at("s_mm").get<double>(), axis.at(1).get<double>(), axis.at(2).get<double>(),
                        section.at("diameter_mm").get<double>(), section.at("circularity_mm").get<double>()});
  }
  return sections;
}

TruthComparison compare(const Measurement& measurement, const nlohmann::json& truth) {
  const auto sections = read_sections(truth);
  TruthComparison result;
  result.length_mm = truth.at("length_mm").get<double>();
  result.max_deflection_mm = truth.at("max_deflection_mm").get<double>();
  std::vector<double> circularities;
  const auto by_diameter = [](const TrueSection& a, const TrueSection& b) { return a.diameter_mm < b.diameter_mm; };
  result.diameter_min_mm = std::min_element(sections.begin(), sections.end(), by_diameter)->diameter_mm;
  result.diameter_max_mm = std::max_element(sections.begin(), sections.end(), by_diameter)->diameter_mm;
  for (const TrueSection& section : sections) circularities.push_back(section.circularity_mm);
  std::nth_element(circularities.begin(), circularities.begin() + static_cast<std::ptrdiff_t>(circularities.size() / 2),
                   circularities.end());
  result.circularity_median_mm = circularities[circularities.size() / 2];

  std::vector<double> axis, diameter, circularity, axis_ci, diameter_ci, circularity_ci;
  for (const auto& section : measurement.sections) {
    const TrueSection at = interpolate(sections, section.s_mm);
    axis.push_back(std::hypot(section.axis_mm[1] - at.y_mm, section.axis_mm[2] - at.z_mm));
    diameter.push_back(section.diameter_mm - at.diameter_mm);
    circularity.push_back(section.circularity_mm - at.circularity_mm);
    axis_ci.push_back(section.axis_ci95_mm);
    diameter_ci.push_back(section.diameter_ci95_mm);
    circularity_ci.push_back(section.circularity_ci95_mm);
    result.sections.push_back({.s_mm = section.s_mm,
                               .axis_mm = {section.s_mm, at.y_mm, at.z_mm},
                               .deflection_mm = std::hypot(at.y_mm, at.z_mm),
                               .diameter_mm = at.diameter_mm,
                               .circularity_mm = at.circularity_mm,
                               .axis_ci95_mm = 0.0,
                               .diameter_ci95_mm = 0.0,
                               .circularity_ci95_mm = 0.0});
  }
  result.axis_rms_mm = rms(axis);
  result.axis_max_mm = *std::max_element(axis.begin(), axis.end());
  result.diameter_rms_mm = rms(diameter);
  result.diameter_rms_best90_mm = rms(diameter, 0.9);
  result.circularity_rms_mm = rms(circularity);
  result.axis_covered = covered(axis, axis_ci);
  result.diameter_covered = covered(diameter, diameter_ci);
  result.circularity_covered = covered(circularity, circularity_ci);
  return result;
}

}  // namespace

Result<TruthComparison> compare_with_truth(const Measurement& measurement, const std::filesystem::path& truth_file) {
  const auto text = read_file(truth_file);
  if (!text) return pass_on(text.error());
  try {
    const auto truth = nlohmann::json::parse(*text);
    if (truth.at("schema") != "imprint.truth/1" || truth.at("sections").empty() || measurement.sections.empty()) {
      return invalid_input("{}: expected schema \"imprint.truth/1\" with sections", truth_file.string());
    }
    return compare(measurement, truth);
  } catch (const nlohmann::json::exception& error) {
    return invalid_input("{}: not a truth file: {}", truth_file.string(), error.what());
  }
}

nlohmann::json to_json(const TruthComparison& c) {
  return {{"length_mm", c.length_mm},
          {"max_deflection_mm", c.max_deflection_mm},
          {"diameter_min_mm", c.diameter_min_mm},
          {"diameter_max_mm", c.diameter_max_mm},
          {"circularity_median_mm", c.circularity_median_mm},
          {"axis_rms_mm", c.axis_rms_mm},
          {"axis_max_mm", c.axis_max_mm},
          {"diameter_rms_mm", c.diameter_rms_mm},
          {"diameter_rms_best90_mm", c.diameter_rms_best90_mm},
          {"circularity_rms_mm", c.circularity_rms_mm},
          {"axis_covered", c.axis_covered},
          {"diameter_covered", c.diameter_covered},
          {"circularity_covered", c.circularity_covered}};
}

}  // namespace imprint
