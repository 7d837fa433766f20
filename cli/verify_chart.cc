#include "cli/verify_chart.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/core.h>

#include "cli/report_look.h"
#include "fusion/report/markup.h"
#include "fusion/report/plot.h"

namespace imprint {
namespace {

constexpr double kLeastRange_mm = 0.001;
constexpr double kChartHeight = 340.0, kChartWidth = 900.0, kTitleHeight = 30.0;

// In the order in which they first stand there.
std::vector<std::pair<std::string, std::vector<HistoryRow>>> by_what(const std::vector<HistoryRow>& rows) {
  std::vector<std::pair<std::string, std::vector<HistoryRow>>> result;
  for (const HistoryRow& row : rows) {
    auto it = std::find_if(result.begin(), result.end(), [&](const auto& entry) { return entry.first == row.what; });
    if (it == result.end()) it = result.insert(result.end(), {row.what, {}});
    it->second.push_back(row);
  }
  return result;
}

std::string chart(const std::vector<HistoryRow>& rows) {
  const double gap = std::numeric_limits<double>::quiet_NaN();
  Plot plot;
  plot.x_label = "verification, from the first";
  plot.y_label = "deviation in mm";
  std::vector<PlotPoint> upper, lower;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double x = static_cast<double>(i) + 1.0;
    plot.points.push_back({x, rows[i].deviation_mm, rows[i].ci95_mm});
    upper.push_back({x, rows[i].limit_mm, 0.0});
    lower.push_back({x, -rows[i].limit_mm, 0.0});
    if (!rows[i].pass) plot.mark = plot.points.back();
  }
  plot.reference = upper;
  plot.reference.push_back({0.0, gap, 0.0});
  plot.reference.insert(plot.reference.end(), lower.begin(), lower.end());
  const PlotRange range = range_of({&plot.points, &plot.reference}, kLeastRange_mm);
  plot.low = range.low;
  plot.high = range.high;
  return draw(plot);
}

std::string caption(const std::string& what, const std::vector<HistoryRow>& rows) {
  const auto failed = std::count_if(rows.begin(), rows.end(), [](const HistoryRow& row) { return !row.pass; });
  return fmt::format("{}: {} verifications from {} to {}, {} failed", what, rows.size(), rows.front().time_utc,
                     rows.back().time_utc, failed);
}

std::string table(const std::vector<HistoryRow>& rows) {
  std::string text =
      "<table><tr><th>time (UTC)</th><th class=\"number\">deviation mm</th><th class=\"number\">95 %</th>"
      "<th class=\"number\">limit mm</th><th>cameras</th><th>result</th></tr>\n";
  for (const HistoryRow& row : rows)
    text += fmt::format(
        "<tr><td>{}</td><td class=\"number\">{:+.4f}</td><td class=\"number\">{:.4f}</td><td "
        "class=\"number\">{:.4f}</td>"
        "<td>{}</td><td>{}</td></tr>\n",
        markup_text(row.time_utc), row.deviation_mm, row.ci95_mm, row.limit_mm, markup_text(row.cameras),
        row.pass ? "pass" : "fail");
  return text + "</table>\n";
}

// `svg` as drawn by itself, moved down within a larger picture.
std::string nested(std::string svg, double y) {
  const std::string start = "<svg ";
  if (svg.compare(0, start.size(), start) == 0)
    svg.insert(start.size(), fmt::format("y=\"{}\" width=\"{}\" height=\"300\" ", y, kChartWidth));
  return svg;
}

}  // namespace

std::string draw_history(const std::vector<HistoryRow>& rows, bool as_page) {
  const auto all = by_what(rows);
  if (as_page) {
    std::string body;
    for (const auto& [what, of_one] : all)
      body += fmt::format("<figure><figcaption>{}</figcaption>{}</figure>\n{}", markup_text(caption(what, of_one)),
                          chart(of_one), table(of_one));
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Verifications</title>\n<style>\n{}"
        "</style></head>\n<body><h1>Verifications</h1>\n{}</body></html>\n",
        kReportLook, body);
  }
  std::string content;
  double y = 0.0;
  for (const auto& [what, of_one] : all) {
    content += fmt::format("<text x=\"4\" y=\"{}\">{}</text>{}\n", y + 20.0, markup_text(caption(what, of_one)),
                           nested(chart(of_one), y + kTitleHeight));
    y += kChartHeight;
  }
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\">\n<style><![CDATA[\n{}]]></style>\n{}</svg>\n",
      kChartWidth, y, kReportLook, content);
}

}  // namespace imprint
