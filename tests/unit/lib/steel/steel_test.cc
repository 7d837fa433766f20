#include "lib/steel/steel.h"

#include <fstream>

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {

TEST_CASE("steel: the table is that of EN 1993-1-2 at temperatures between its rows") {
  const auto steels = known_steels();
  REQUIRE(steels);
  const auto carbon = find_steel(*steels, "42crmo4");
  REQUIRE(carbon);
  CHECK(carbon->source.find("EN 1993-1-2") != std::string::npos);
  // Equations 3.1a to c; rows are 50 C apart, over which the parabola leaves a straight line by 2.5e-6.
  CHECK(expansion_at(*carbon, 20.0, 0.0)->share == Approx(0.0).margin(1e-9));
  CHECK(expansion_at(*carbon, 425.0, 0.0)->share == Approx(1.2e-5 * 425 + 0.4e-8 * 425 * 425 - 2.416e-4).margin(3e-6));
  CHECK(expansion_at(*carbon, 800.0, 0.0)->share == Approx(1.1e-2).margin(1e-9));
  CHECK(expansion_at(*carbon, 1033.0, 0.0)->share == Approx(2e-5 * 1033 - 6.2e-3).margin(1e-9));
  // Equation C.1.
  const auto austenitic = find_steel(*steels, "1.4301");
  REQUIRE(austenitic);
  CHECK(expansion_at(*austenitic, 975.0, 0.0)->share ==
        Approx((16.0 + 4.79e-3 * 975 - 1.243e-6 * 975 * 975) * 955.0 * 1e-6).margin(3e-6));
}

TEST_CASE("steel: an unsure temperature makes the expansion unsure, also on the transformation's plateau") {
  const auto steels = known_steels();
  const auto carbon = find_steel(*steels, "carbon");
  REQUIRE(carbon);
  const auto sure = expansion_at(*carbon, 1000.0, 0.0), unsure = expansion_at(*carbon, 1000.0, 50.0);
  CHECK(sure->sigma == Approx(0.04 * 0.0138));
  CHECK(unsure->sigma == Approx(std::hypot(0.04 * 0.0138, 2e-5 * 50.0)));
  CHECK(expansion_at(*carbon, 800.0, 100.0)->sigma > expansion_at(*carbon, 800.0, 10.0)->sigma);
}

TEST_CASE("steel: unknown grades and temperatures outside the table are refused with what there is") {
  const auto steels = known_steels();
  const auto unknown = find_steel(*steels, "unobtainium");
  REQUIRE_FALSE(unknown);
  CHECK(unknown.error().message.find("42CrMo4") != std::string::npos);
  const auto hot = expansion_at(steels->front(), 1500.0, 0.0);
  REQUIRE_FALSE(hot);
  CHECK(hot.error().message.find("20 to 1200 C") != std::string::npos);
  CHECK_FALSE(expansion_at(steels->front(), std::nan(""), 0.0));
}

TEST_CASE("steel: a file of one's own names what is wrong in it") {
  const TemporaryFolder folder;
  const auto fault = [&](const std::string& text) {
    const auto path = folder / "own.toml";
    std::ofstream(path) << text;
    const auto steels = read_steels(path);
    return steels ? std::string() : steels.error().message;
  };
  const std::string head = "[[steel]]\nname = \"a\"\nsource = \"b\"\nsigma_share = 0.1\n";
  CHECK(fault(head + "expansion = [[20, 0], [1000, 14.5]]\n").empty());
  CHECK(fault(head + "expansion = [[20, 0], [10, 1]]\n").find("ascending") != std::string::npos);
  CHECK(fault(head + "expansion = [[20, 0], [30]]\n").find("expected rows") != std::string::npos);
  CHECK(fault("x = 1\n").find("[[steel]]") != std::string::npos);
}

}  // namespace imprint
