#include "lib/clock/wall_clock.h"

#include <catch2/catch.hpp>

namespace imprint {

TEST_CASE("clock: times are UTC to the millisecond, also before the epoch") {
  REQUIRE(utc_text(0) == "1970-01-01T00:00:00.000Z");
  REQUIRE(utc_text(1'767'225'599'999'000'000) == "2025-12-31T23:59:59.999Z");
  REQUIRE(utc_text(-1'000'000) == "1969-12-31T23:59:59.999Z");
}

}  // namespace imprint
