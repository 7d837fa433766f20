#include "lib/recording/mcap_file.h"

#include <catch2/catch.hpp>

#include "lib/config/atomic_file.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Three messages on two topics of one schema; the file's bytes.
std::string recorded(const TemporaryFolder& folder) {
  auto writer = McapWriter::open(folder / "a.mcap");
  REQUIRE(writer);
  REQUIRE(writer->write("cam/cam1", "imprint.v1.Imprint", "described", 1'700'000'000'000'000'001, Bytes{1, 2, 0}));
  REQUIRE(writer->write("cam/cam2", "imprint.v1.Imprint", "described", 5, Bytes{}));
  REQUIRE(writer->write("cam/cam1", "imprint.v1.Imprint", "described", 6, Bytes(5000, 7)));
  REQUIRE_FALSE(std::filesystem::exists(folder / "a.mcap"));
  REQUIRE(writer->close());
  REQUIRE_FALSE(std::filesystem::exists(folder / "a.mcap.part"));
  return *read_file(folder / "a.mcap");
}

}  // namespace

TEST_CASE("mcap: what was recorded is read in order, with topic, schema, time and every byte") {
  const TemporaryFolder folder;
  recorded(folder);
  const auto content = read_mcap(folder / "a.mcap");
  REQUIRE(content);
  REQUIRE_FALSE(content->cut_off);
  REQUIRE(content->messages.size() == 3);
  REQUIRE(content->messages[0].topic == "cam/cam1");
  REQUIRE(content->messages[0].schema == "imprint.v1.Imprint");
  REQUIRE(content->messages[0].time_ns == 1'700'000'000'000'000'001);
  REQUIRE(content->messages[0].bytes == Bytes{1, 2, 0});
  REQUIRE(content->messages[1].topic == "cam/cam2");
  REQUIRE(content->messages[1].bytes.empty());
  REQUIRE(content->messages[2].bytes == Bytes(5000, 7));
}

TEST_CASE("mcap: a recording that was cut off anywhere is whole up to there") {
  const TemporaryFolder folder;
  const std::string whole = recorded(folder);
  std::size_t before = 0;
  for (std::size_t length = 8; length < whole.size(); length += 13) {
    const auto content = read_mcap(folder.write("cut.mcap", whole.substr(0, length)));
    REQUIRE(content);
    REQUIRE(content->messages.size() >= before);
    before = content->messages.size();
    if (before < 3) REQUIRE(content->cut_off);
  }
  REQUIRE(before == 3);
}

TEST_CASE("mcap: damaged files are refused or read, and never crash") {
  const TemporaryFolder folder;
  const std::string whole = recorded(folder);
  for (std::size_t place = 0; place < 400; ++place) {
    std::string damaged = whole;
    damaged[place] = static_cast<char>(~damaged[place]);
    const auto content = read_mcap(folder.write("damaged.mcap", damaged));
    if (!content) REQUIRE(content.error().exit_status() == 2);
  }
  REQUIRE_FALSE(read_mcap(folder.write("text.mcap", "no recording at all")));
  REQUIRE_FALSE(read_mcap(folder / "none.mcap"));
  REQUIRE_FALSE(McapWriter::open(folder / "no/such/folder.mcap"));
}

}  // namespace imprint
