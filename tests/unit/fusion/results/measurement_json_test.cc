#include <cmath>

#include <catch2/catch.hpp>

#include "fusion/results/measurement.h"

namespace imprint {
namespace {

Measurement example() {
  Measurement m;
  m.method = "best";
  m.straightness = {.max_deflection = {7.1, 0.3},
                    .max_deflection_at_mm = 900.0,
                    .max_deflection_direction_deg = 40.0,
                    .total_indicator = {14.0, 0.7},
                    .per_metre = {2.0, 0.1},
                    .minimum_zone = {6.9, 0.2}};
  m.diameters = {.mean = {260.0, 0.1},
                 .smallest = {200.0, 0.2},
                 .largest = {300.0, 0.3},
                 .smallest_at_mm = 10.0,
                 .largest_at_mm = 800.0};
  m.gain = {6, {0.9, 1.0, 2.0}, {0.2, 0.1, 0.3}};
  m.sections = {{.s_mm = 0.0,
                 .axis_mm = {0.0, 1.0, 2.0},
                 .deflection_mm = 2.2,
                 .diameter_mm = 200.0,
                 .circularity_mm = 1.0,
                 .axis_ci95_mm = 0.1,
                 .diameter_ci95_mm = 0.2,
                 .circularity_ci95_mm = 0.3},
                {.s_mm = 10.0,
                 .axis_mm = {10.0, 3.0, 2.0},
                 .deflection_mm = 3.6,
                 .diameter_mm = 210.0,
                 .circularity_mm = 2.0,
                 .axis_ci95_mm = 0.2,
                 .diameter_ci95_mm = 0.1,
                 .circularity_ci95_mm = 0.3}};
  m.roundness = {{{2.0, 0.1}, {1.9, 0.1}, {2.1, 0.2}}, {{3.0, 0.1}, {2.9, 0.1}, {3.1, 0.2}}};
  m.stations = {{"head", 2.5}};
  m.cooling = cooling_of(*known_steels(), "42CrMo4", {1000.0, 20.0, "pyrometer"}).value();
  return m;
}

TEST_CASE("measurement: the cold forging is smaller by the steel's expansion, and less surely known") {
  const Measurement m = example();
  const Length cold = m.cooling->cold(m.diameters.mean);
  CHECK(cold.mm == Approx(260.0 / 1.0138));
  // 4 % of the expansion and 20 C, at 2e-5 a C.
  CHECK(
      cold.ci95_mm ==
      Approx(std::hypot(0.1 / 1.0138, 1.96 * 260.0 * std::hypot(0.04 * 0.0138, 4e-4) / 1.0138 / 1.0138)).epsilon(1e-3));
  CHECK(to_json(m)["cold"]["temperature_source"] == "pyrometer");
  CHECK(to_json(m)["cold"]["diameter_mean_mm"].get<double>() == Approx(cold.mm));
}

}  // namespace

TEST_CASE("measurement: what is written is read again, whole") {
  const auto json = to_json(example());
  const auto again = measurement_from_json(json);
  REQUIRE(again);
  CHECK(to_json(*again) == json);
  CHECK(again->roundness[1].minimum_circumscribed.mm == 3.1);
  CHECK(again->gain.first_alone.diameter_ci95_mm == 1.0);
}

TEST_CASE("measurement: a result without the fields of later versions is read") {
  auto json = to_json(example());
  for (const char* field : {"straightness", "diameters", "gain", "geometry"}) json.erase(field);
  for (auto& section : json["sections"]) section.erase("roundness_ls_mm");
  const auto read = measurement_from_json(json);
  REQUIRE(read);
  CHECK(read->roundness.empty());
  CHECK(read->gain.observations == 0);
  CHECK(read->sections.size() == 2);
}

TEST_CASE("measurement: between two sections the diameter is theirs in proportion, with the wider interval") {
  const Measurement m = example();
  const auto between = section_at(m, 2.5);
  CHECK(between.diameter_mm == Approx(202.5));
  CHECK(between.diameter_ci95_mm == 0.2);
  CHECK(between.axis_mm[1] == Approx(1.5));
  CHECK(section_at(m, -5.0).diameter_mm == 200.0);
  CHECK(section_at(m, 50.0).diameter_mm == 210.0);
}

}  // namespace imprint
