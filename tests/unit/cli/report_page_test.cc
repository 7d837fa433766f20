#include "cli/report_page.h"

#include <catch2/catch.hpp>

using namespace imprint;
using Catch::Matchers::Contains;

namespace {

Measurement measured(const std::string& session = "S-7", const std::string& camera = "cam1") {
  Measurement m;
  m.session = session;
  m.method = "best";
  m.line = "plant/L1";
  m.made_at = "2026-11-22T18:05:02.123Z";
  m.length_mm = 1498.76;
  m.length_ci95_mm = 0.42;
  m.max_deflection_mm = 3.21;
  for (int i = 0; i < 500; ++i) {
    const double s = 3.0 * i;
    m.sections.push_back(
        {s, {s, i == 200 ? 3.21 : 0.0, 0.0}, i == 200 ? 3.21 : 0.0, 200.0 + 0.01 * i, 1.5, 0.17, 0.31, 0.11});
  }
  CameraShare used, left_out;
  used.id = camera;
  used.targets_used = 21;
  used.reprojection_rms_px = 0.087;
  left_out.id = "cam2";
  left_out.excluded = true;
  left_out.reason = "too few targets";
  m.observations.push_back({0, 60.0, {used, left_out}});
  return m;
}

std::string page_of(const Measurement& m, const TruthComparison* truth = nullptr) {
  return report_page(m, to_json(m), truth);
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

nlohmann::json embedded(const std::string& page) {
  const std::string begin = "<script id=\"result\" type=\"application/json\">";
  const auto from = page.find(begin) + begin.size();
  return nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
}

}  // namespace

TEST_CASE("report page: shows the figures of the result with their 95 % intervals") {
  const std::string page = page_of(measured());
  CHECK_THAT(
      page, Contains("<dd>plant/L1</dd>") && Contains("<dd>S-7</dd>") && Contains("<dd>2026-11-22T18:05:02.123Z</dd>"));
  CHECK_THAT(page, Contains("length, mm</td><td class=\"number\">1498.76</td><td class=\"number\">0.42</td></tr>"));
  CHECK_THAT(page, Contains("</small></td><td class=\"number\">3.21</td><td class=\"number\">0.17</td></tr>"));
  CHECK_THAT(page, Contains("<td class=\"number\">204.99</td><td class=\"number\">0.31</td></tr>"));
  CHECK_THAT(page, Contains("<td>used</td><td class=\"number\">21</td><td class=\"number\">0.087</td>"));
  CHECK_THAT(page, Contains("<td class=\"excluded\">left out</td>") && Contains("too few targets"));
  CHECK_THAT(page, Contains("No warnings."));
}

TEST_CASE("report page: with a truth it stands beside the measured, with the error") {
  TruthComparison truth;
  truth.length_mm = 1500.0;
  truth.sections = measured().sections;
  const std::string page = page_of(measured(), &truth);
  CHECK_THAT(
      page, Contains("<td class=\"number\">0.42</td><td class=\"number\">1500.00</td><td class=\"number\">-1.24</td>"));
  CHECK(count(page, "class=\"reference\"") == 4);
  CHECK(count(page_of(measured()), "class=\"reference\"") == 0);
}

TEST_CASE("report page: every warning stands before the results") {
  Measurement m = measured();
  m.warnings = {"cam2 was left out", "intervals are wide"};
  const std::string page = page_of(m);
  CHECK(page.find("2 warnings") < page.find("Results"));
  CHECK(page.find("intervals are wide") < page.find("Results"));
}

TEST_CASE("report page: no id, reason or warning can leave its place") {
  const std::string hostile = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&<!--";
  Measurement m = measured(hostile, hostile);
  m.line = m.method = m.made_at = hostile;
  m.observations[0].cameras[1].reason = hostile;
  m.warnings = {hostile};
  const std::string page = page_of(m);
  CHECK(count(page, "<script") == 1);
  CHECK(count(page, "</script") == 1);
  CHECK(count(page, "<img") == 0);
  CHECK(count(page, "<!--") == 0);
  CHECK(embedded(page)["session"] == hostile);
}

TEST_CASE("report page: carries the result as it was, with what this program does not know of") {
  const Measurement m = measured();
  auto document = to_json(m);
  document["of_a_later_version"] = {1, 2.5, "x"};
  CHECK(embedded(report_page(m, document)) == document);
}

TEST_CASE("report page: needs nothing from elsewhere and runs no script") {
  const std::string page = page_of(measured());
  for (const char* reference : {"src=", "href=", "@import", "url(", "javascript"}) CHECK(count(page, reference) == 0);
  CHECK(count(page, "<script") == count(page, "type=\"application/json\""));
  CHECK(count(page, "http") == count(page, "http://www.w3.org/"));  // names of XML vocabularies, never fetched
}

TEST_CASE("report page: one section is enough") {
  Measurement m = measured();
  m.sections.resize(1);
  CHECK_THAT(page_of(m), Contains("1 of 1 sections"));
}
