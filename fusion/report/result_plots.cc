#include "fusion/report/result_plots.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "fusion/report/plot.h"

namespace imprint {
namespace {

using Section = Measurement::Section;
using Sections = std::vector<Section>;

constexpr double kLeastRangeMm = 0.05;  // beyond the curve: a straight forging must not look crooked
constexpr const char* kAlong = "x in mm from the first end";

std::vector<PlotPoint> curve(const Sections& sections, const std::function<double(const Section&)>& value,
                             double Section::*ci95) {
  std::vector<PlotPoint> points;
  points.reserve(sections.size());
  for (const Section& section : sections) points.push_back({section.s_mm, value(section), section.*ci95});
  return points;
}

// The half-width that all bands but the widest tenth keep to.
double usual_ci95(const std::vector<PlotPoint>& points) {
  constexpr double kUsualShare = 0.9;  // the slopes of steps, where a width means little, take less than a tenth
  std::vector<double> widths;
  for (const PlotPoint& p : points) {
    if (std::isfinite(p.ci95)) widths.push_back(p.ci95);
  }
  if (widths.empty()) return 0.0;
  const auto at = widths.begin() + static_cast<std::ptrdiff_t>(kUsualShare * static_cast<double>(widths.size() - 1));
  std::nth_element(widths.begin(), at, widths.end());
  return *at;
}

// The curves' range with their bands in view, but for those that are out of the ordinary: one bad stretch must not
// press the rest flat.
PlotRange range_with_bands(const std::vector<const std::vector<PlotPoint>*>& curves) {
  std::vector<PlotPoint> edges;
  for (const auto* points : curves) {
    const double usual = usual_ci95(*points);
    for (const PlotPoint& p : *points) {
      const double ci95 = std::isfinite(p.ci95) ? std::min(p.ci95, usual) : 0.0;
      edges.push_back({p.x, p.y + ci95, 0.0});
      edges.push_back({p.x, p.y - ci95, 0.0});
    }
  }
  return range_of({&edges}, kLeastRangeMm);
}

std::string draw_curve(std::string y_label, PlotRange range, std::vector<PlotPoint> points,
                       std::vector<PlotPoint> reference, std::optional<PlotPoint> mark = std::nullopt) {
  return draw({.x_label = kAlong,
               .y_label = std::move(y_label),
               .low = range.low,
               .high = range.high,
               .points = std::move(points),
               .reference = std::move(reference),
               .mark = mark});
}

std::string draw_direction(double y_mm, double z_mm) {
  // Looking along +x from the first end with z up, as one who stands there sees it: y points to the left.
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-140 -125 240 225\" role=\"img\">"
      "<circle cx=\"0\" cy=\"0\" r=\"90\" fill=\"none\" class=\"zero\"/>"
      "<line x1=\"-90\" y1=\"0\" x2=\"90\" y2=\"0\" class=\"grid\"/>"
      "<line x1=\"0\" y1=\"-90\" x2=\"0\" y2=\"90\" class=\"grid\"/>"
      "<text x=\"-98\" y=\"5\" text-anchor=\"end\">+y</text><text x=\"0\" y=\"-98\" text-anchor=\"middle\">+z</text>";
  if (const double size = std::hypot(y_mm, z_mm); size > 0.0) {
    svg += fmt::format("<line x1=\"0\" y1=\"0\" x2=\"{:.2f}\" y2=\"{:.2f}\" class=\"needle\"/>", -88.0 * y_mm / size,
                       -88.0 * z_mm / size);
  }
  return svg + "</svg>";
}

}  // namespace

ResultPlots draw_result(const Measurement& measurement, const Sections& reference) {
  const Sections& sections = measurement.sections;
  if (sections.empty()) return {};
  const auto y = [](const Section& s) { return s.axis_mm[1]; };
  const auto z = [](const Section& s) { return s.axis_mm[2]; };
  const auto diameter = [](const Section& s) { return s.diameter_mm; };
  const auto circularity = [](const Section& s) { return s.circularity_mm; };
  const auto worst = *std::ranges::max_element(sections, {}, &Section::deflection_mm);

  const auto axis_y = curve(sections, y, &Section::axis_ci95_mm), axis_z = curve(sections, z, &Section::axis_ci95_mm);
  const auto true_y = curve(reference, y, &Section::axis_ci95_mm), true_z = curve(reference, z, &Section::axis_ci95_mm);
  const std::vector<PlotPoint> zero = {{0.0, 0.0, 0.0}};
  const PlotRange both = range_with_bands({&axis_y, &axis_z, &true_y, &true_z, &zero});  // the eye compares the planes

  const auto width = curve(sections, diameter, &Section::diameter_ci95_mm);
  const auto true_width = curve(reference, diameter, &Section::diameter_ci95_mm);
  const auto shape = curve(sections, circularity, &Section::circularity_ci95_mm);
  const auto true_shape = curve(reference, circularity, &Section::circularity_ci95_mm);
  PlotRange round = range_with_bands({&shape, &true_shape});
  round.low = 0.0;
  return {.axis_xy = draw_curve("y in mm", both, axis_y, true_y, PlotPoint{worst.s_mm, y(worst), 0.0}),
          .axis_xz = draw_curve("z in mm", both, axis_z, true_z, PlotPoint{worst.s_mm, z(worst), 0.0}),
          .diameter = draw_curve("diameter in mm", range_with_bands({&width, &true_width}), width, true_width),
          .circularity = draw_curve("circularity in mm", round, shape, true_shape),
          .direction = draw_direction(y(worst), z(worst))};
}

}  // namespace imprint
