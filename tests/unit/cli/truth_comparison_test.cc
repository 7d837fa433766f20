#include "cli/truth_comparison.h"

#include <catch2/catch.hpp>

#include "cli/result_table.h"
#include "tests/unit/temporary_folder.h"

using namespace imprint;
using Catch::Matchers::Contains;

namespace {

// A straight true cylinder of 1000 mm, 200 mm thick, 2 mm out of round.
nlohmann::json true_cylinder() {
  nlohmann::json truth = {{"schema", "imprint.truth/1"},
                          {"length_mm", 1000.0},
                          {"max_deflection_mm", 0.0},
                          {"sections", nlohmann::json::array()}};
  for (int i = 0; i <= 100; ++i) {
    const double s = 10.0 * i;
    truth["sections"].push_back(
        {{"s_mm", s}, {"axis_mm", {s, 0.0, 0.0}}, {"diameter_mm", 200.0 + 0.01 * s}, {"circularity_mm", 2.0}});
  }
  return truth;
}

Measurement measured_with(double dy_mm, double diameter_error_mm, int wild_sections) {
  Measurement measurement;
  measurement.session = "test";
  measurement.length_mm = 1000.5;
  for (int i = 0; i < 500; ++i) {
    const double s = 1000.0 * i / 499.0;
    const double error = i < wild_sections ? 30.0 : diameter_error_mm;
    measurement.sections.push_back({s, {s, dy_mm, 0.0}, dy_mm, 200.0 + 0.01 * s + error, 2.0, 0.5, 0.3, 0.1});
  }
  return measurement;
}

}  // namespace

TEST_CASE("truth comparison: errors are those put in") {
  TemporaryFolder folder;
  const auto truth = folder.write("truth.json", true_cylinder().dump());
  const auto result = compare_with_truth(measured_with(0.4, -0.2, 0), truth);
  REQUIRE(result);
  CHECK(result->axis_rms_mm == Approx(0.4));
  CHECK(result->axis_max_mm == Approx(0.4));
  CHECK(result->diameter_rms_mm == Approx(0.2));
  CHECK(result->circularity_rms_mm == Approx(0.0).margin(1e-12));
  CHECK(result->diameter_max_mm == Approx(210.0));
  CHECK(result->axis_covered == 1.0);
}

TEST_CASE("truth comparison: the best 90 % leaves out the largest tenth, no more") {
  TemporaryFolder folder;
  const auto truth = folder.write("truth.json", true_cylinder().dump());
  CHECK(compare_with_truth(measured_with(0.0, 0.2, 50), truth)->diameter_rms_best90_mm == Approx(0.2));
  CHECK(compare_with_truth(measured_with(0.0, 0.2, 60), truth)->diameter_rms_best90_mm > 1.0);
  CHECK(compare_with_truth(measured_with(0.0, 0.2, 50), truth)->diameter_rms_mm > 1.0);
  CHECK(compare_with_truth(measured_with(0.0, 0.4, 0), truth)->diameter_covered == 0.0);
}

TEST_CASE("truth comparison: a file that is no truth is refused by name") {
  TemporaryFolder folder;
  const auto measurement = measured_with(0.0, 0.0, 0);
  CHECK_THAT(compare_with_truth(measurement, folder / "none.json").error().message, Contains("none.json"));
  CHECK_THAT(compare_with_truth(measurement, folder.write("a.json", "{")).error().message, Contains("a.json"));
  CHECK_THAT(compare_with_truth(measurement, folder.write("b.json", "{\"schema\": \"other\"}")).error().message,
             Contains("b.json"));
}

TEST_CASE("result table: shows measured, truth and error of the length") {
  TemporaryFolder folder;
  const auto measurement = measured_with(0.4, 0.1, 0);
  const auto truth = compare_with_truth(measurement, folder.write("truth.json", true_cylinder().dump()));
  const std::string table = result_table(measurement, &*truth);
  CHECK_THAT(table, Contains("1000.50") && Contains("1000.00") && Contains("+0.50"));
  CHECK_THAT(result_table(measurement), !Contains("truth"));
}
