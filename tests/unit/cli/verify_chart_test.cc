#include "cli/verify_chart.h"

#include <catch2/catch.hpp>

namespace imprint {
namespace {

std::vector<HistoryRow> history() {
  return {{"2026-01-01T00:00:00Z", "bar 1-2", 2000, 2000.05, 0.05, 0.02, 0.2, "cam1 cam2", true},
          {"2026-01-01T00:00:00Z", "target <7>", 0, 0.1, 0.1, 0.02, 0.2, "cam1 cam2", true},
          {"2026-01-02T00:00:00Z", "bar 1-2", 2000, 2000.35, 0.35, 0.02, 0.2, "cam1 cam2", false}};
}

int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

}  // namespace

TEST_CASE("verify chart: one chart for each thing checked, its limits dashed, its failure marked") {
  const std::string svg = draw_history(history(), false);
  CHECK(count(svg, "<svg") == 3);  // the picture and two charts
  CHECK(count(svg, "</svg>") == 3);
  CHECK(count(svg, "class=\"reference\"") == 4);  // both limits of both
  CHECK(count(svg, "class=\"mark\"") == 1);
  CHECK(svg.find("bar 1-2: 2 verifications") != std::string::npos);
  CHECK(svg.find("<7>") == std::string::npos);  // spelled out
}

TEST_CASE("verify chart: the page lists every verification") {
  const std::string page = draw_history(history(), true);
  CHECK(count(page, "<figure") == 2);
  CHECK(count(page, "<td>pass</td>") == 2);
  CHECK(count(page, "<td>fail</td>") == 1);
  CHECK(page.find("+0.3500") != std::string::npos);
}

}  // namespace imprint
