#include "cli/result_table.h"

#include <catch2/catch.hpp>

using namespace imprint;

TEST_CASE("result table: every warning has its line, without warnings there is none") {
  Measurement measurement;
  REQUIRE(warning_lines(measurement).empty());
  measurement.warnings = {"observation 0: camera cam2 left out: not connected", "the other"};
  REQUIRE(warning_lines(measurement) ==
          "  warning: observation 0: camera cam2 left out: not connected\n  warning: the other\n");
}
