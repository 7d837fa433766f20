#include "lib/targets/coordinate_list.h"

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

Result<TargetField> field_of(const std::string& text, const CoordinateListFormat& format = {}) {
  const TemporaryFolder folder;
  return read_coordinate_list(folder.write("list.txt", text), format);
}

}  // namespace

TEST_CASE("coordinate list: blanks, tabs, commas and semicolons divide; columns beyond those named are ignored") {
  for (const std::string text :
       {"7 1.5 -2 3 0.01 9 9\n# remark\n\n8  4\t5 6\n", "7,1.5,-2,3,,x\n8, 4,5 ,6\r\n", "7;1.5;-2;3\n8;4;5;6\n"}) {
    const auto field = field_of(text);
    REQUIRE(field.has_value());
    REQUIRE(field->targets.size() == 2);
    CHECK(field->targets.at(7).p_world_mm == Eigen::Vector3d(1.5, -2.0, 3.0));
    CHECK(field->targets.at(8).p_world_mm == Eigen::Vector3d(4.0, 5.0, 6.0));
    CHECK_FALSE(field->targets.at(7).sigma_mm.has_value());
  }
}

TEST_CASE("coordinate list: columns in another order, a header, metres and sigmas") {
  CoordinateListFormat format{"x,y,z,-,sigma,id", 2, 1000.0};
  const auto field = field_of("made by a program\nX Y Z code s name\n0.1 0.2 0.3 abc 0.00002 41\n", format);
  REQUIRE(field.has_value());
  CHECK(field->targets.at(41).p_world_mm.isApprox(Eigen::Vector3d(100.0, 200.0, 300.0)));
  CHECK(field->targets.at(41).sigma_mm.value() == Approx(0.02));
}

TEST_CASE("coordinate list: bad rows and double ids are refused with their lines") {
  const auto message = [](const std::string& text, const CoordinateListFormat& format = {}) {
    const auto field = field_of(text, format);
    REQUIRE_FALSE(field.has_value());
    CHECK(field.error().exit_status() == 2);
    return field.error().message;
  };
  CHECK(message("id x y z\n1 2 3 4\n").find(":1:") != std::string::npos);
  CHECK(message("1 2 3 4\n2 3 4\n").find(":2:") != std::string::npos);
  CHECK(message("1 2 3 nan\n").find(":1:") != std::string::npos);
  CHECK(message("1.5 2 3 4\n").find(":1:") != std::string::npos);
  const std::string twice = message("1 2 3 4\n2 3 4 5\n1 7 8 9\n");
  CHECK(twice.find(":3:") != std::string::npos);
  CHECK(twice.find("line 1") != std::string::npos);
  CHECK(message("").find("none") != std::string::npos);
  CHECK(message("1 2 3 4\n", {"id,x,y", 0, 1.0}).find("--columns") != std::string::npos);
  CHECK(message("1 2 3 4\n", {"id,x,x,y,z", 0, 1.0}).find("--columns") != std::string::npos);
  CHECK(message("1 2 3 4 -0.1\n", {"id,x,y,z,sigma", 0, 1.0}).find(":1:") != std::string::npos);
}

}  // namespace imprint
