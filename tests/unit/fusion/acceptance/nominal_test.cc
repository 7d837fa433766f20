#include "fusion/acceptance/nominal.h"

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

const std::string kCsv =
    "name,from_mm,to_mm,diameter_mm,lower_mm,upper_mm,finish_diameter_mm\n"
    "head,0,170,180,-2,4,170\nbody,170,1900,250,-2,4,\n";

std::string fault(const std::string& name, const std::string& text) {
  const TemporaryFolder folder;
  const auto nominal = read_nominal(folder.write(name, text));
  return nominal ? std::string() : nominal.error().message;
}

}  // namespace

TEST_CASE("nominal: CSV and TOML say the same") {
  const TemporaryFolder folder;
  const auto csv = read_nominal(folder.write("shaft.csv", kCsv));
  const auto toml = read_nominal(folder.write(
      "shaft.toml",
      "cold = true\nmax_deflection_mm = 5.0\nmin_stock_mm = 2.0\n"
      "[[step]]\nname = \"head\"\nfrom_mm = 0\nto_mm = 170\ndiameter_mm = 180\nlower_mm = -2\nupper_mm = 4\n"
      "finish_diameter_mm = 170\n[[step]]\nfrom_mm = 170\nto_mm = 1900\ndiameter_mm = 250\nlower_mm = -2\nupper_mm = "
      "4\n"));
  REQUIRE(csv);
  REQUIRE(toml);
  REQUIRE(csv->steps.size() == 2);
  REQUIRE(toml->steps.size() == 2);
  CHECK(csv->name == "shaft");
  CHECK(toml->cold);
  CHECK(toml->min_stock_mm == 2.0);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(csv->steps[i].diameter_mm == toml->steps[i].diameter_mm);
    CHECK(csv->steps[i].finish_diameter_mm == toml->steps[i].finish_diameter_mm);
  }
  CHECK_FALSE(csv->steps[1].finish_diameter_mm.has_value());
  const Nominal hot = toml->grown(0.01);
  CHECK(hot.steps[1].to_mm == Approx(1919.0));
  CHECK(hot.steps[0].finish_diameter_mm == Approx(171.7));
  CHECK(hot.steps[0].lower_mm == Approx(-2.02));
}

TEST_CASE("nominal: what is wrong is named with its line or key") {
  CHECK(fault("a.csv", "name,from_mm\n").find("a.csv:1: expected the header") != std::string::npos);
  CHECK(fault("a.csv", kCsv + "tail,1800,1950,200,-1,1,\n").find("a.csv:4: expected from_mm of at least 1900") !=
        std::string::npos);
  CHECK(fault("a.csv", kCsv + "tail,1900,x,200,-1,1,\n").find("a.csv:4") != std::string::npos);
  CHECK(fault("a.csv", kCsv + "tail,1900,2000,200,1,-1,\n").find("lower_mm < upper_mm") != std::string::npos);
  CHECK(fault("a.toml", "[[step]]\nfrom_mm = 0\nto_mm = 10\n").find("step[0].diameter_mm") != std::string::npos);
  CHECK(fault("a.toml", "max_deflexion_mm = 2\n").find("max_deflexion_mm: unknown key") != std::string::npos);
  CHECK(fault("a.toml", "min_stock_mm = -1\n").find("min_stock_mm") != std::string::npos);
  CHECK(fault("a.toml", "name = \"empty\"\n").find("at least one step") != std::string::npos);
  CHECK(fault("a.txt", "").find(".toml or .csv") != std::string::npos);
}

}  // namespace imprint
