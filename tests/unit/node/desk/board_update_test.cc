#include "node/service/board_update.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "lib/config/atomic_file.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

struct Board {
  TemporaryFolder folder;
  BoardUpdate update{folder / "data", folder / "root"};

  Board() {
    for (const char* name : {"data", "root/etc", "root/run/imprint"})
      std::filesystem::create_directories(folder / name);
  }
  void runs_image() const {
    folder.write("root/run/imprint/slot", "B\n");
    folder.write("root/etc/imprint-version", "0.1.0+abc\n");
  }
  [[nodiscard]] nlohmann::json status() const {
    const auto bytes = update.status();
    REQUIRE(bytes);
    return nlohmann::json::parse(*bytes);
  }
};

}  // namespace

TEST_CASE("board update: the status says which image runs from which slot, and whether it was judged good") {
  const Board board;
  CHECK(board.status()["slot"] == "");
  board.runs_image();
  CHECK(board.status()["slot"] == "B");
  CHECK(board.status()["image_version"] == "0.1.0+abc");
  CHECK(board.status()["slot_good"] == false);
  board.folder.write("root/run/imprint/slot-state", "good\n");
  board.folder.write("data/update-state", "failed: signature\nmore\n");
  CHECK(board.status()["slot_good"] == true);
  CHECK(board.status()["update"] == "failed: signature");
}

TEST_CASE("board update: a wish is left for the board's service; another word is refused") {
  const Board board;
  board.runs_image();
  REQUIRE(board.update.want("http://10.0.0.5:8090/bundle.raucb"));
  CHECK(read_file(board.folder / "data" / "update-wanted").value() == "http://10.0.0.5:8090/bundle.raucb\n");
  CHECK(board.status()["update"] == "asked for");
  REQUIRE(board.update.want("rollback"));
  CHECK(read_file(board.folder / "data" / "update-wanted").value() == "rollback\n");
  for (const char* wish :
       {"", "reboot", "file:///etc/passwd", "http://a b", "http://a/$(reboot)", "http://a\nrollback"}) {
    const auto refused = board.update.want(wish);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().exit_status() == 2);
  }
}

TEST_CASE("board update: nothing is wished of a machine without an image, nor while one is installed") {
  const Board board;
  CHECK_FALSE(board.update.want("rollback"));
  board.runs_image();
  board.folder.write("data/update-state", "installing http://x\n");
  const auto refused = board.update.want("rollback");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message == "an update is being installed at this moment");
}

}  // namespace imprint
