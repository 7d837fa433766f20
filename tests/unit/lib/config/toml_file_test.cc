#include "lib/config/toml_file.h"

#include <catch2/catch.hpp>

#include "lib/config/atomic_file.h"
#include "tests/unit/temporary_folder.h"

using namespace imprint;
using Catch::Matchers::Contains;

TEST_CASE("config: a syntax error names file and line") {
  TemporaryFolder folder;
  const auto table = parse_toml_file(folder.write("a.toml", "[camera]\nid = \n"));
  REQUIRE(!table);
  CHECK(table.error().exit_status() == 2);
  CHECK_THAT(table.error().message, Contains("a.toml:2"));
}

TEST_CASE("config: a missing file is an error that names it") {
  TemporaryFolder folder;
  const auto table = parse_toml_file(folder / "none.toml");
  REQUIRE(!table);
  CHECK_THAT(table.error().message, Contains("none.toml") && Contains("No such file"));
}

TEST_CASE("config: a value of the wrong kind names line, key and what was expected") {
  TemporaryFolder folder;
  const auto path = folder.write("a.toml", "[camera]\nid = \"x\"\nwidth_px = \"wide\"\n");
  const auto table = parse_toml_file(path);
  REQUIRE(table);
  TomlReader read(path, *table);
  CHECK(read.string("camera.id") == "x");
  CHECK(!read.error());
  read.integer("camera.width_px");
  REQUIRE(read.error());
  CHECK_THAT(read.error()->message, Contains("a.toml:3") && Contains("camera.width_px") && Contains("whole number"));
}

TEST_CASE("config: infinity is not a number to measure with") {
  const auto table = toml::parse("a = inf\nb = [1.0, nan]");
  TomlReader read("x.toml", table);
  read.number("a");
  CHECK(read.error());
  TomlReader again("x.toml", table);
  again.numbers("b", 2);
  CHECK(again.error());
}

TEST_CASE("config: a missing key without a default is an error, with one it is the default") {
  const toml::table table;
  TomlReader read("x.toml", table);
  CHECK(read.number("a.b", 2.5) == 2.5);
  CHECK(!read.error());
  read.number("a.b");
  REQUIRE(read.error());
  CHECK_THAT(read.error()->message, Contains("a.b") && Contains("missing"));
}

TEST_CASE("config: --set replaces a value, makes a section, and takes bare words as texts") {
  auto table = toml::parse("[zenoh]\nlisten = [\"a\"]\n");
  REQUIRE(apply_override(table, "zenoh.listen=[\"b\", \"c\"]"));
  REQUIRE(apply_override(table, "node.camera_id=cam2"));
  REQUIRE(apply_override(table, "node.period_s=2.5"));
  CHECK(table.at_path("zenoh.listen[1]").value<std::string>() == "c");
  CHECK(table.at_path("node.camera_id").value<std::string>() == "cam2");
  CHECK(table.at_path("node.period_s").value<double>() == 2.5);
  CHECK(!apply_override(table, "nonsense"));
  CHECK(!apply_override(table, "section=3"));
}

TEST_CASE("atomic file: a file that cannot be written leaves nothing behind") {
  TemporaryFolder folder;
  CHECK(!write_file_atomically(folder / "no/such/folder/a.json", "x"));
  std::filesystem::create_directory(folder / "taken");
  CHECK(!write_file_atomically(folder / "taken", "x"));  // a folder cannot be replaced by a file
  std::filesystem::remove(folder / "taken");
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("atomic file: what was written is read back") {
  TemporaryFolder folder;
  const std::string bytes("a\0b\n", 4);
  REQUIRE(write_file_atomically(folder / "a.bin", bytes));
  CHECK(read_file(folder / "a.bin").value() == bytes);
  REQUIRE(write_file_atomically(folder / "a.bin", ""));
  CHECK(read_file(folder / "a.bin").value().empty());
}
