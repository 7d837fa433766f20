#include <catch2/catch.hpp>

#include "fusion/fusion_pipeline.h"
#include "tests/unit/fusion/triangulate/forging_sessions.h"

using namespace imprint;

TEST_CASE("fuse: the geometry asked for is the one that is used, and the result names it") {
  test::Rod rod = test::stepped_rod();
  test::make_out_of_round(rod, 3.0, 200.0, 5);
  const test::Session session = test::observe(rod, {.noise_px = 0.1, .seed = 5});
  const std::vector<Observation> observations{
      {.index = 0, .rotation_deg = 0.0, .imprints = session.imprints[0], .missing = {}}};
  const auto joint = fuse(observations, session.spec, "s", "best");
  const auto thesis = fuse(observations, session.spec, "s", "best", GeometryMethod::thesis);
  REQUIRE(joint);
  REQUIRE(thesis);
  CHECK(joint->geometry == "joint");
  CHECK(thesis->geometry == "thesis");
  CHECK(thesis->observations[0].cameras.size() == 3);
  // The same rod, by two ways: alike, and not the same.
  CHECK(thesis->length_mm == Approx(joint->length_mm).margin(10.0));
  CHECK(thesis->sections[250].diameter_mm == Approx(joint->sections[250].diameter_mm).margin(5.0));
  CHECK(thesis->sections[250].diameter_mm != joint->sections[250].diameter_mm);
  const auto again = measurement_from_json(to_json(*thesis));
  REQUIRE(again);
  CHECK(again->geometry == "thesis");
}
