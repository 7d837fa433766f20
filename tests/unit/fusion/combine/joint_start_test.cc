#include "fusion/combine/joint_start.h"

#include <vector>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

std::vector<ObservedForging> seen_with_lengths(std::vector<double> lengths_mm) {
  std::vector<ObservedForging> observations;
  for (const double length : lengths_mm) {
    ObservedForging observed;
    observed.start_world_mm = {100, 0, 0}, observed.end_world_mm = {100 + length, 0, 0};
    observations.push_back(observed);
  }
  return observations;
}

CombinedForging rod(double length_mm, double diameter_mm) {
  CombinedForging combined;
  combined.length_mm = length_mm;
  combined.sections.resize(10);
  for (auto& section : combined.sections) section.diameter_mm = diameter_mm;
  return combined;
}

ForgingSpec spec() {
  ForgingSpec forging;
  forging.diameter_min_mm = 200, forging.diameter_max_mm = 300;
  return forging;
}

}  // namespace

TEST_CASE("joint start: a forging far longer than any observation saw it is an error, not a result") {
  const auto observations = seen_with_lengths({1900, 1930});
  CombinedForging stretched = rod(24470, 250), plain = rod(1910, 250);
  CHECK(within_rig(observations, spec(), plain).has_value());
  const auto refused = within_rig(observations, spec(), stretched);
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error().message, Catch::Contains("24470 mm") && Catch::Contains("1930 mm"));
}

TEST_CASE("joint start: sections outside the rig's diameters are named, and refused where they are most") {
  const auto observations = seen_with_lengths({1900});
  CombinedForging some = rod(1900, 250), most = rod(1900, 500);
  some.sections[3].diameter_mm = 500;
  CHECK(within_rig(observations, spec(), some).has_value());
  CHECK(some.warnings.size() == 1);
  CHECK_FALSE(within_rig(observations, spec(), most));
}

}  // namespace imprint
