#include "lib/camera/dot_disc.h"

#include <fstream>

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

using namespace imprint;
using Catch::Matchers::Contains;

TEST_CASE("dots: a file comes back as written") {
  const TemporaryFolder folder;
  const DotDiscs dots{{3, {14.0, Eigen::Vector3d(0.6, 0.0, -0.8), 0}}, {7, {2.5, Eigen::Vector3d::UnitZ(), 0}}};
  REQUIRE(write_dot_discs(dots, folder / "dots.csv"));
  const auto read = read_dot_discs(folder / "dots.csv");
  REQUIRE(read);
  REQUIRE(read->size() == 2);
  CHECK(read->at(3).radius == Approx(14.0));
  CHECK((read->at(3).normal - dots.at(3).normal).norm() < 1e-6);
}

TEST_CASE("dots: what is no dot is refused with file and line") {
  const TemporaryFolder folder;
  const auto path = folder / "dots.csv";
  for (const std::string rows : {"1,28,0,0\n", "1,28,0,0,2\n", "1,-28,0,0,1\n", "1,inf,0,0,1\n", "1,28,0,0,1,9\n",
                                 "1,28,nan,0,1\n", "x,28,0,0,1\n"}) {
    INFO(rows);
    std::ofstream(path) << "id,diameter_mm,nx,ny,nz\n" << rows;
    const auto read = read_dot_discs(path);
    REQUIRE(!read);
    CHECK(read.error().exit_status() == 2);
    CHECK_THAT(read.error().message, Contains("dots.csv:2"));
  }
  std::ofstream(path) << "id,diameter_mm,nx,ny,nz\n4,28,0,0,1\n4,28,0,0,1\n";
  CHECK_THAT(read_dot_discs(path).error().message, Contains("dots.csv:3") && Contains("twice"));
  std::ofstream(path) << "id,x_mm,y_mm,z_mm\n1,0,0,0\n";
  CHECK_THAT(read_dot_discs(path).error().message, Contains("dots.csv:1") && Contains("id,diameter_mm,nx,ny,nz"));
  std::ofstream(path) << "";
  CHECK(!read_dot_discs(path));
}
