#include "node/service/thermometer.h"

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {

TEST_CASE("thermometer: a sensor of the kernel is found by its chip's name, in thousandths of a degree") {
  const TemporaryFolder folder;
  for (const auto& [number, chip] : {std::pair{"hwmon0", "nvme"}, {"hwmon1", "cpu_thermal"}}) {
    std::filesystem::create_directories(folder / number);
    folder.write(std::string(number) + "/name", std::string(chip) + "\n");
  }
  folder.write("hwmon1/temp1_input", "48250\n");
  REQUIRE(Thermometer::open("hwmon:cpu_thermal/temp1", folder.path())->read() == Approx(48.25));
  REQUIRE_FALSE(Thermometer::open("hwmon:cpu_thermal/temp2", folder.path())->read());
  REQUIRE_FALSE(Thermometer::open("hwmon:other/temp1", folder.path())->read());
}

TEST_CASE("thermometer: nothing, nonsense and a broken sensor give no temperature; a mistyped source is an error") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(Thermometer::open("")->read());
  REQUIRE_FALSE(Thermometer::open("file:" + folder.write("a", "warm").string())->read());
  REQUIRE_FALSE(Thermometer::open("file:" + folder.write("b", "-128000").string())->read());
  REQUIRE(Thermometer::open("file:" + folder.write("c", "-5000").string())->read() == Approx(-5.0));
  for (const char* source : {"hwmon:", "hwmon:chip", "hwmon:chip/", "47", "/sys/x"})
    REQUIRE_FALSE(Thermometer::open(source));
}

TEST_CASE("thermometer: the simulated one stays within what a board has") {
  const auto celsius = Thermometer::open("simulated")->read();
  REQUIRE(celsius);
  REQUIRE(*celsius >= 25.0);
  REQUIRE(*celsius <= 45.0);
}

}  // namespace imprint
