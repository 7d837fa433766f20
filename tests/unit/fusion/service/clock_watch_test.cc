#include "fusion/clock_watch.h"

#include <catch2/catch.hpp>

namespace imprint {

TEST_CASE("clock watch: the offset is true within its uncertainty, however the way is divided") {
  const std::int64_t now_ns = 1'700'000'000'000'000'000;
  for (const std::int64_t offset_ns : {0L, -3'600'000'000'000L, 5'000L}) {
    for (const std::int64_t there_ns : {0L, 200'000L, 1'000'000L}) {
      const std::int64_t back_ns = 1'000'000 - there_ns, thinking_ns = 7'000'000;
      const std::int64_t received_ns = now_ns + there_ns + offset_ns;
      const auto measured =
          clock_offset(now_ns, received_ns, received_ns + thinking_ns, now_ns + there_ns + thinking_ns + back_ns);
      REQUIRE(measured.uncertainty_ns == 500'001);  // half of 1 ms there and back, and a rounding
      REQUIRE(std::abs(measured.offset_ns - offset_ns) <= measured.uncertainty_ns);
      if (there_ns == 500'000) REQUIRE(measured.offset_ns == offset_ns);
    }
  }
}

}  // namespace imprint
