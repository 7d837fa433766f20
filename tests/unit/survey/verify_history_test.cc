#include "survey/verify_history.h"

#include <thread>

#include <catch2/catch.hpp>

#include "lib/config/atomic_file.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

HistoryRow row_of(double deviation_mm) {
  return {"2026-01-02T03:04:05Z",       "bar 1-2", 2000.0, 2000.0 + deviation_mm, deviation_mm, 0.05, 0.2, "cam1 cam2",
          std::abs(deviation_mm) <= 0.2};
}

}  // namespace

TEST_CASE("verify history: rows come back as they were added") {
  const TemporaryFolder folder;
  const auto path = folder / "verify.csv";
  REQUIRE(append_history(path, {row_of(0.1)}).has_value());
  REQUIRE(append_history(path, {row_of(-0.3), row_of(0.0)}).has_value());
  const auto rows = read_history(path);
  REQUIRE(rows.has_value());
  REQUIRE(rows->size() == 3);
  CHECK((*rows)[1].deviation_mm == Approx(-0.3));
  CHECK_FALSE((*rows)[1].pass);
  CHECK((*rows)[2].cameras == "cam1 cam2");
  CHECK((*rows)[0].time_utc == "2026-01-02T03:04:05Z");
}

TEST_CASE("verify history: several writers lose no row") {
  const TemporaryFolder folder;
  const auto path = folder / "verify.csv";
  std::vector<std::thread> writers;
  for (int i = 0; i < 4; ++i)
    writers.emplace_back([&path] {
      for (int k = 0; k < 20; ++k) (void)append_history(path, {row_of(0.01 * k), row_of(0.02 * k)});
    });
  for (std::thread& writer : writers) writer.join();
  const auto rows = read_history(path);
  REQUIRE(rows.has_value());
  CHECK(rows->size() == 160);
}

TEST_CASE("verify history: another file is left as it is") {
  const TemporaryFolder folder;
  const auto other = folder.write("field.csv", "id,x_mm,y_mm,z_mm\n1,2,3,4\n");
  const auto refused = append_history(other, {row_of(0.1)});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().message.find("field.csv:1") != std::string::npos);
  CHECK(read_file(other).value() == "id,x_mm,y_mm,z_mm\n1,2,3,4\n");
  const auto path = folder / "verify.csv";
  REQUIRE(append_history(path, {row_of(0.1)}).has_value());
  const std::string whole = read_file(path).value();
  const auto cut = folder.write("cut.csv", whole.substr(0, whole.size() - 5));
  CHECK_FALSE(append_history(cut, {row_of(0.1)}).has_value());
  CHECK_FALSE(append_history(folder / "nowhere/verify.csv", {row_of(0.1)}).has_value());
  const auto bad = folder.write("bad.csv", whole + "x,y\n");
  CHECK(read_history(bad).error().message.find("bad.csv:3") != std::string::npos);
}

}  // namespace imprint
