#include "survey/scale_bar.h"

#include <catch2/catch.hpp>

#include "lib/config/atomic_file.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

Result<std::vector<ScaleBar>> bars_in(const std::string& text) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "bars.csv";
  REQUIRE(write_file_atomically(path, text).has_value());
  return read_scale_bars(path);
}

}  // namespace

TEST_CASE("scale bars: ids, length and sigma are read") {
  const auto bars = bars_in("id_a,id_b,length_mm,sigma_mm\r\n7, 9 ,1998.1234,0.008\n\n3,4,1000,0.01\n");
  REQUIRE(bars.has_value());
  REQUIRE(bars->size() == 2);
  CHECK(bars->front().id_b == 9);
  CHECK(bars->front().length_mm == 1998.1234);
  CHECK(bars->back().sigma_mm == 0.01);
}

TEST_CASE("scale bars: a bad row is refused with its line") {
  const std::string header = "id_a,id_b,length_mm,sigma_mm\n";
  for (const std::string row : {"1,2,1000", "1,2,-1000,0.01", "1,2,1000,0", "1,1,1000,0.01", "1,2,nan,0.01",
                                "1,2,1000,0.01,5", "a,2,1000,0.01"}) {
    const auto bars = bars_in(header + row + "\n");
    REQUIRE_FALSE(bars.has_value());
    CHECK(bars.error().message.find("bars.csv:2") != std::string::npos);
    CHECK(bars.error().exit_status() == 2);
  }
  CHECK(bars_in(header + "1,2,1000,0.01\n2,1,1000,0.01\n").error().message.find(":3") != std::string::npos);
  CHECK_FALSE(bars_in(header).has_value());
  CHECK_FALSE(bars_in("").has_value());
  CHECK_FALSE(bars_in("id,x,y\n1,2,3\n").has_value());
}

}  // namespace imprint
