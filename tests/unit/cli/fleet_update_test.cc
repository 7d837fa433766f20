#include "cli/fleet_update.h"

#include <deque>
#include <map>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

using std::chrono::seconds;

/// Boards whose answers a test has written down; each look takes the next, the last one stays.
class WrittenBoards final : public Boards {
 public:
  std::map<std::string, std::deque<BoardState>> answers;
  std::vector<std::string> wishes;

  void plan(const std::string& camera, std::deque<BoardState> states) {
    for (BoardState& state : states) state.camera_id = camera;
    answers[camera] = std::move(states);
  }
  BoardState state(const std::string& camera) override {
    auto& left = answers.at(camera);
    BoardState next = left.front();
    if (left.size() > 1) left.pop_front();
    return next;
  }
  Result<void> want(const std::string& camera, const std::string& wish) override {
    wishes.push_back(camera + " " + wish);
    return {};
  }
  void pause() override { time_ += seconds(2); }
  std::chrono::steady_clock::time_point now() override { return time_; }

 private:
  std::chrono::steady_clock::time_point time_{};
};

BoardState old_image() { return {"", "1", "A", true, "", "", ""}; }
BoardState installing() { return {"", "1", "A", true, "installing", "", ""}; }
BoardState away() { return {"", "", "", false, "", "", "nobody answers"}; }
BoardState new_image(bool good) { return {"", "2", "B", good, "installed; starting", "", ""}; }

Result<void> update(WrittenBoards& boards) {
  return change_fleet(boards, {"cam1", "cam2", "cam3"}, {"http://x/b", "2", seconds(60)}, [](const std::string&) {});
}

}  // namespace

TEST_CASE("fleet: each board is begun when the one before runs the image and has judged it good") {
  WrittenBoards boards;
  for (const char* camera : {"cam1", "cam2", "cam3"})
    boards.plan(camera, {old_image(), old_image(), installing(), away(), new_image(false), new_image(true)});
  REQUIRE(update(boards));
  CHECK(boards.wishes == std::vector<std::string>{"cam1 http://x/b", "cam2 http://x/b", "cam3 http://x/b"});
}

TEST_CASE("fleet: a board that went back stops it, and those after it are left as they are") {
  WrittenBoards boards;
  boards.plan("cam1", {old_image(), installing(), new_image(true)});
  boards.plan(
      "cam2",
      {old_image(), installing(), away(), {"", "1", "A", true, "installed; starting", "slot B: no camera", ""}});
  boards.plan("cam3", {old_image()});
  const auto done = update(boards);
  REQUIRE_FALSE(done);
  CHECK(done.error().message == "cam2: went back to slot A: slot B: no camera; stopped, as they were: cam3");
  CHECK(boards.wishes.size() == 2);
}

TEST_CASE("fleet: a bundle that a board refuses, and a board that never judges, stop it") {
  WrittenBoards boards;
  BoardState refused = old_image();
  refused.update = "failed: signature";
  boards.plan("cam1", {old_image(), installing(), refused});
  CHECK(update(boards).error().message == "cam1: failed: signature; stopped, as they were: cam2 cam3");
  boards.plan("cam1", {old_image(), new_image(false)});
  CHECK(update(boards).error().message == "cam1: not within 60 s; stopped, as they were: cam2 cam3");
  boards.plan("cam1", {away()});
  CHECK(update(boards).error().message == "cam1: nobody answers; stopped, as they were: cam2 cam3");
}

TEST_CASE("fleet: an old failure is no answer to a new wish, and a board that is there already is not asked") {
  WrittenBoards boards;
  BoardState before = old_image();
  before.update = "failed: disk";
  boards.plan("cam1", {before, before, installing(), new_image(true)});
  boards.plan("cam2", {new_image(true)});
  boards.plan("cam3", {new_image(true)});
  REQUIRE(update(boards));
  CHECK(boards.wishes == std::vector<std::string>{"cam1 http://x/b"});
}

TEST_CASE("fleet: a rollback is done when a board runs from its other slot") {
  WrittenBoards boards;
  boards.plan("cam1", {new_image(true), {"", "2", "B", true, "rolled back; starting", "", ""}, away(), old_image()});
  REQUIRE(change_fleet(boards, {"cam1"}, {"rollback", "", seconds(60)}, [](const std::string&) {}));
}

}  // namespace imprint
