#include "lib/targets/lookup_table.h"

#include <unistd.h>

#include <fstream>

#include <catch2/catch.hpp>

using namespace imprint;
namespace fs = std::filesystem;

namespace {

/// The table in a file that is removed at the end of the test.
struct Table {
  fs::path path = fs::temp_directory_path() / fmt::format("imprint_lookup_test_{}.txt", getpid());
  explicit Table(const std::string& text) { std::ofstream(path) << text; }
  ~Table() { fs::remove(path); }
};

std::string message_of(const std::string& text) {
  const Table table(text);
  const auto library = read_lookup_table(table.path, 8, {});
  REQUIRE_FALSE(library);
  CHECK(library.error().exit_status() == 2);
  return library.error().message;
}

}  // namespace

TEST_CASE("lookup table: ids, codes and radii are kept and the distance is worked out") {
  const Table table("# id code\n 7 1\n\n9\t11\r\n");
  const auto library = read_lookup_table(table.path, 8, {1.0, 1.5, 2.5});
  REQUIRE(library);
  REQUIRE(library->codes.size() == 2);
  CHECK(library->codes[0].id == 7);
  CHECK(library->codes[1].code == 11);
  CHECK(library->min_distance == 2);
  CHECK(library->geometry.ring_outer_radius == 2.5);
}

TEST_CASE("lookup table: every bad row is an error that names its line") {
  CHECK(message_of("1 3\n2 x\n").find(":2:") != std::string::npos);
  CHECK(message_of("1 3 5\n").find(":1:") != std::string::npos);
  CHECK(message_of("1 256\n").find(":1:") != std::string::npos);
  CHECK(message_of("1 -3\n").find(":1:") != std::string::npos);
  CHECK(message_of("1 3\n1 5\n").find(":2:") != std::string::npos);
  CHECK(message_of("1 3\n\n2 6\n").find(":3:") != std::string::npos);  // 6 is 3 turned
  message_of("");
}

TEST_CASE("lookup table: a missing file is an error") { CHECK_FALSE(read_lookup_table("no/such/table.txt", 14, {})); }
