#include "cli/report_page.h"

#include <algorithm>

#include <fmt/core.h>

#include "cli/acceptance_table.h"
#include "cli/report_look.h"
#include "cli/result_summary.h"
#include "cli/result_table.h"
#include "fusion/report/markup.h"
#include "fusion/report/result_plots.h"

namespace imprint {
namespace {

constexpr std::size_t kListedSections = 25;  // fit half a page; all are in the embedded document

std::string cell(const std::string& text, const char* kind = "") {
  return *kind != '\0' ? fmt::format("<td class=\"{}\">{}</td>", kind, text) : fmt::format("<td>{}</td>", text);
}

std::string number(double value, int digits = 2) { return cell(fmt::format("{:.{}f}", value, digits), "number"); }

std::string known_number(double value, int digits = 2) {
  return value > 0.0 ? number(value, digits) : cell("–", "number");
}

std::string or_dash(const std::string& text) { return text.empty() ? "–" : markup_text(text); }

std::string heading(const Measurement& m) {
  const std::string session = or_dash(m.session);
  return fmt::format(
      "<header><h1>Measurement of a forging: {0}</h1><dl><dt>Line</dt><dd>{1}</dd><dt>Session</dt><dd>{0}</dd>"
      "<dt>Time</dt><dd>{2}</dd><dt>Method</dt><dd>{3}</dd></dl></header>\n",
      session, or_dash(m.line), or_dash(m.made_at), markup_text(m.method));
}

std::string warnings(const Measurement& m) {
  if (m.warnings.empty()) return "<p class=\"fine\">No warnings.</p>\n";
  std::string items;
  for (const std::string& warning : m.warnings) items += "<li>" + markup_text(warning) + "</li>";
  return fmt::format("<div class=\"alert\" id=\"warnings\"><strong>{} warning{}</strong><ul>{}</ul></div>\n",
                     m.warnings.size(), m.warnings.size() == 1 ? "" : "s", items);
}

std::string result_rows(const Measurement& m, const TruthComparison* truth) {
  std::string rows;
  for (const ResultRow& row : summarize(m, truth)) {
    const std::string note = row.note.empty() ? "" : "<small>" + markup_text(row.note) + "</small>";
    rows += "<tr>" + cell(markup_text(row.what) + note) + number(row.measured) + known_number(row.ci95);
    if (row.truth) rows += number(*row.truth) + cell(fmt::format("{:+.2f}", row.measured - *row.truth), "number");
    rows += "</tr>\n";
  }
  return rows;
}

std::string acceptance(const nlohmann::json& document) {
  const std::vector<std::string> lines = acceptance_lines(document);
  if (lines.empty()) return "";
  std::string text = "<h2>Against the nominal</h2>\n<ul id=\"nominal\">";
  for (const std::string& line : lines) text += "<li>" + markup_text(line) + "</li>";
  return text + "</ul>\n";
}

std::string figure(const char* id, const char* caption, const std::string& svg) {
  return fmt::format("<figure id=\"{}\"><figcaption>{}</figcaption>{}</figure>\n", id, caption, svg);
}

std::string results(const Measurement& m, const TruthComparison* truth, const ResultPlots& drawn) {
  std::string text = fmt::format(
      "<h2>Results</h2>\n<div class=\"beside\"><table id=\"results\"><thead><tr><th></th><th "
      "class=\"number\">measured</th>"
      "<th class=\"number\">± (95 %)</th>{}</tr></thead><tbody>\n{}</tbody></table>\n{}</div>\n",
      truth != nullptr ? "<th class=\"number\">truth</th><th class=\"number\">error</th>" : "", result_rows(m, truth),
      figure("direction", "Largest deflection", drawn.direction));
  text +=
      "<p class=\"note\">The interval of a largest or smallest value is that of its section; a median stands with the "
      "median interval. The direction is seen from the first end, z up.</p>\n";
  if (truth != nullptr) text += "<p>" + markup_text(truth_text(m, *truth)) + ".</p>\n";
  text += "<p id=\"cold\">" + markup_text(cold_source(m)) + ".</p>\n";
  if (m.cooling) {
    text += "<table><tbody>\n";
    for (const ResultRow& row : cold_rows(m))
      text += "<tr>" + cell(markup_text(row.what)) + number(row.measured) + known_number(row.ci95) + "</tr>\n";
    text += "</tbody></table>\n";
  }
  if (m.gain.observations > 0) text += "<p id=\"gain\">" + markup_text(gain_text(m.gain)) + ".</p>\n";
  return text;
}

std::string plots(const ResultPlots& drawn, bool with_truth) {
  return "<h2 class=\"sheet\">Along the length</h2>\n<p class=\"note\">Line: measured; shaded: 95 % interval" +
         std::string(with_truth ? "; dashed: truth" : "") + "; circle: largest deflection.</p>\n<div class=\"plots\">" +
         figure("axis_xy", "Deflection of the axis, xy plane", drawn.axis_xy) +
         figure("axis_xz", "Deflection of the axis, xz plane", drawn.axis_xz) +
         figure("diameter", "Diameter", drawn.diameter) + figure("circularity", "Circularity", drawn.circularity) +
         "</div>\n";
}

std::string camera_row(const Measurement::Observation& observation, const CameraShare& camera) {
  std::string row = "<tr>" + cell(std::to_string(observation.index), "number") +
                    cell(fmt::format("{:.1f}°", observation.rotation_deg), "number") + cell(markup_text(camera.id)) +
                    (camera.excluded ? cell("left out", "excluded") : cell("used")) + number(camera.targets_used, 0) +
                    known_number(camera.reprojection_rms_px, 3) + number(camera.edge_points, 0) + "</tr>\n";
  if (!camera.reason.empty())
    row += "<tr><td></td><td></td><td colspan=\"5\" class=\"reason\">" + markup_text(camera.reason) + "</td></tr>\n";
  return row;
}

std::string cameras(const Measurement& m) {
  std::string rows;
  for (const auto& observation : m.observations) {
    for (const CameraShare& camera : observation.cameras) rows += camera_row(observation, camera);
  }
  return "<h2>Cameras</h2>\n<table id=\"cameras\"><thead><tr><th class=\"number\">Observation</th>"
         "<th class=\"number\">Rotation</th><th>Camera</th><th>State</th><th class=\"number\">Targets</th>"
         "<th class=\"number\">Reproj. rms, px</th><th class=\"number\">Edge points</th></tr></thead>"
         "<tbody>\n" +
         rows + "</tbody></table>\n";
}

std::string section_row(const Measurement::Section& s) {
  return "<tr>" + number(s.s_mm, 1) + number(s.axis_mm[1], 3) + number(s.axis_mm[2], 3) + number(s.deflection_mm, 3) +
         number(s.axis_ci95_mm, 3) + number(s.diameter_mm, 3) + number(s.diameter_ci95_mm, 3) +
         number(s.circularity_mm, 3) + number(s.circularity_ci95_mm, 3) + "</tr>\n";
}

std::string sections(const Measurement& m) {
  const std::size_t last = m.sections.size() - 1;
  const std::size_t listed = std::min(kListedSections, m.sections.size());
  std::string rows;
  for (std::size_t i = 0; i < listed; ++i)
    rows += section_row(m.sections[listed > 1 ? (i * last + (listed - 1) / 2) / (listed - 1) : 0]);
  return fmt::format(
      "<h2 class=\"sheet\">Sections</h2>\n<p class=\"note\">{} of {} sections, mm; all are in the document embedded in "
      "this page.</p>\n"
      "<table id=\"sections\" class=\"sections\"><thead><tr><th class=\"number\">x</th><th class=\"number\">y</th>"
      "<th class=\"number\">z</th><th class=\"number\">deflection</th><th class=\"number\">±</th>"
      "<th class=\"number\">diameter</th><th class=\"number\">±</th><th class=\"number\">circularity</th>"
      "<th class=\"number\">±</th></tr></thead><tbody>\n{}</tbody></table>\n",
      listed, m.sections.size(), rows);
}

}  // namespace

std::string report_page(const Measurement& m, const nlohmann::json& document, const TruthComparison* truth) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\" xmlns=\"http://www.w3.org/1999/xhtml\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<title>Imprint: {}</title>\n<style>\n{}</style>\n</head>\n<body>\n",
      or_dash(m.session), kReportLook);
  const ResultPlots drawn = draw_result(m, truth != nullptr ? truth->sections : std::vector<Measurement::Section>{});
  page += heading(m) + warnings(m) + results(m, truth, drawn) + acceptance(document) + cameras(m) +
          plots(drawn, truth != nullptr) + sections(m);
  page += "<footer>Imprint " IMPRINT_VERSION
          ". x along the ideal axis from the first end, y and z across it; diameter: mean over the directions; "
          "circularity: half of the largest less the smallest width.</footer>\n";
  return page + "<script id=\"result\" type=\"application/json\">" + script_json(document) +
         "</script>\n</body>\n</html>\n";
}

}  // namespace imprint
