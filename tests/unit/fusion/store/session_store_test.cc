#include "fusion/store/session_store.h"

#include <sys/wait.h>
#include <unistd.h>

#include <SQLiteCpp/SQLiteCpp.h>
#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::unique_ptr<SessionStore> open(const std::filesystem::path& path) {
  auto store = SessionStore::open(path);
  if (!store) FAIL(store.error().message);
  return std::move(*store);
}

Imprint imprint_of(const std::string& camera, std::uint64_t sequence, const std::string& session = "S",
                   std::uint64_t boot_id = 1) {
  Imprint imprint;
  imprint.camera_id = camera;
  imprint.session = session;
  imprint.boot_id = boot_id;
  imprint.sequence = sequence;
  return imprint;
}

StoredResult result_of(const std::string& session, bool complete, const std::string& json) {
  return {session, complete, json.empty() ? "no measurement" : "", json, 5, 0};
}

}  // namespace

TEST_CASE("store: what was received comes back byte for byte and in order, also after reopening") {
  const TemporaryFolder folder;
  {
    auto store = open(folder / "a.db");
    REQUIRE(*store->add_trigger({"S", 0, 0.0, 0, 1}, Bytes{9}, 10));
    REQUIRE(*store->add_imprint(imprint_of("cam1", 1), Bytes{1, 0, 2}, {11}));
    REQUIRE(*store->add_imprint(imprint_of("cam2", 1), Bytes{0, 255}, {12, true, -3}));
  }
  auto store = open(folder / "a.db");
  const auto messages = *store->messages("S");
  REQUIRE(messages.size() == 3);
  REQUIRE(messages[0].is_trigger);
  REQUIRE(messages[1].bytes == Bytes{1, 0, 2});
  REQUIRE(messages[2].bytes == Bytes{0, 255});
  REQUIRE(messages[2].reception.received_ns == 12);
  REQUIRE(messages[2].reception.late);
  REQUIRE(messages[2].reception.clock_offset_ns == -3);
  REQUIRE_FALSE(messages[1].reception.late);
  REQUIRE_FALSE(messages[1].reception.clock_offset_ns);
  REQUIRE_FALSE(messages[2].is_trigger);
}

TEST_CASE("store: an imprint or a trigger that is there already is not stored again") {
  const TemporaryFolder folder;
  auto store = open(folder / "a.db");
  REQUIRE(*store->add_imprint(imprint_of("cam1", 1), Bytes{1}, {1}));
  REQUIRE_FALSE(*store->add_imprint(imprint_of("cam1", 1), Bytes{1}, {2}));
  REQUIRE(*store->add_imprint(imprint_of("cam1", 1, "S", 0xFFFFFFFFFFFFFFFFULL), Bytes{1}, {2}));  // another boot
  REQUIRE(*store->add_trigger({"S", 0, 0.0, 0, 1}, Bytes{7}, 3));
  REQUIRE_FALSE(*store->add_trigger({"S", 0, 0.0, 0, 1}, Bytes{7}, 4));
  REQUIRE(*store->add_trigger({"S", 0, 90.0, 0, 1}, Bytes{8}, 4));
  REQUIRE(store->messages("S")->size() == 4);
}

TEST_CASE("store: a session has one result, with a revision that grows when it changes and only then") {
  const TemporaryFolder folder;
  auto store = open(folder / "a.db");
  REQUIRE(*store->put_result(result_of("S", false, "")) == 1);
  REQUIRE(*store->put_result(result_of("T", true, R"({"length_mm": 1500.5, "observations": [{}, {}]})")) == 2);
  REQUIRE(*store->put_result(
              result_of("S", true, R"({"length_mm": 2.0, "max_deflection_mm": 1.5, "observations": []})")) == 3);
  auto unchanged = result_of("S", true, R"({"length_mm": 2.0, "max_deflection_mm": 1.5, "observations": []})");
  unchanged.made_ns = 99;
  REQUIRE(*store->put_result(unchanged) == 3);
  REQUIRE(store->result("S")->value().made_ns == 5);
  REQUIRE(store->result("S")->value().complete);
  REQUIRE(store->latest_result()->value().session == "S");
  REQUIRE_FALSE(store->result("U")->has_value());
  const auto sessions = *store->sessions(10);
  REQUIRE(sessions.size() == 2);
  REQUIRE(sessions[0].session == "S");
  REQUIRE(*sessions[0].max_deflection_mm == 1.5);
  REQUIRE(*sessions[1].length_mm == 1500.5);
  REQUIRE_FALSE(sessions[1].max_deflection_mm);
  REQUIRE(sessions[1].observations == 2);
}

TEST_CASE("store: unfinished sessions are those without a complete result or with a newer imprint") {
  const TemporaryFolder folder;
  auto store = open(folder / "a.db");
  for (const char* session : {"done", "open", "none", "late"}) {
    REQUIRE(store->add_imprint(imprint_of("cam1", 1, session, std::hash<std::string>{}(session)), Bytes{1}, {1}));
  }
  REQUIRE(store->put_result(result_of("done", true, "{}")));
  REQUIRE(store->put_result(result_of("open", false, "{}")));
  REQUIRE(store->put_result(result_of("late", true, "{}")));
  REQUIRE(store->add_imprint(imprint_of("cam2", 1, "late"), Bytes{1}, {2}));
  REQUIRE(*store->unfinished(10) == std::vector<std::string>{"open", "none", "late"});
  REQUIRE(*store->unfinished(1) == std::vector<std::string>{"late"});
  // Evaluating it again with the same outcome settles it all the same.
  REQUIRE(store->put_result(result_of("late", true, "{}")));
  REQUIRE(*store->unfinished(10) == std::vector<std::string>{"open", "none"});
  REQUIRE(*store->knows("done"));
  REQUIRE_FALSE(*store->knows("elsewhere"));
}

TEST_CASE("store: what came after a position is found, results as they stand now") {
  const TemporaryFolder folder;
  auto store = open(folder / "a.db");
  REQUIRE(*store->add_trigger({"S", 3, 0.0, 0, 1}, Bytes{9}, 10));
  REQUIRE(*store->add_imprint(imprint_of("cam1", 7, "S", 0xFFFFFFFFFFFFFFFFULL), Bytes{1}, {11, true, -3}));
  REQUIRE(store->put_result(result_of("S", false, "")));
  REQUIRE(store->put_result(result_of("T", true, "{}")));
  REQUIRE(store->put_result(result_of("S", true, "{}")));
  const auto all = *store->messages_after(0, 10);
  REQUIRE(all.size() == 2);
  CHECK(all[0].is_trigger);
  CHECK(all[0].observation == 3);
  CHECK(all[1].session == "S");
  CHECK(all[1].camera_id == "cam1");
  CHECK(all[1].boot_id == 0xFFFFFFFFFFFFFFFFULL);
  CHECK(all[1].sequence == 7);
  CHECK(all[1].reception.clock_offset_ns == -3);
  CHECK(store->messages_after(0, 1)->size() == 1);
  CHECK(store->messages_after(all[0].id, 10)->front().id == all[1].id);
  const auto results = *store->results_after(0, 10);
  REQUIRE(results.size() == 2);
  CHECK(results[0].session == "T");
  CHECK(results[1].session == "S");
  CHECK(results[1].complete);
  CHECK(store->results_after(3, 10)->empty());
  CHECK(store->newest()->message == all[1].id);
  CHECK(store->newest()->revision == 3);
}

TEST_CASE("store: a database has one identity, until it is told to be another") {
  const TemporaryFolder folder;
  const auto first = *open(folder / "a.db")->identity();
  CHECK(*open(folder / "a.db")->identity() == first);
  CHECK(*open(folder / "b.db")->identity() != first);
  REQUIRE(open(folder / "a.db")->renew_identity());
  CHECK(*open(folder / "a.db")->identity() != first);
}

TEST_CASE("store: a process killed without warning loses nothing it was told is stored") {
  const TemporaryFolder folder;
  const pid_t child = ::fork();
  if (child == 0) {
    auto store = SessionStore::open(folder / "a.db");
    for (std::uint64_t i = 1; i <= 50; ++i) (void)(*store)->add_imprint(imprint_of("cam1", i), Bytes{1, 2, 3}, {1});
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(WIFSIGNALED(status));
  REQUIRE(open(folder / "a.db")->messages("S")->size() == 50);
}

TEST_CASE("store: a second fusion node is kept from the database, until the first has ended") {
  const TemporaryFolder folder;
  auto first = open(folder / "a.db");
  const auto second = SessionStore::open(folder / "a.db");
  REQUIRE_FALSE(second);
  REQUIRE(second.error().exit_status() == 2);
  REQUIRE(second.error().message.find("a.db: in use by another imprint-fusion") != std::string::npos);
  REQUIRE(SessionStore::check(folder / "a.db"));  // a config may be checked while the line runs
  first.reset();
  REQUIRE(SessionStore::open(folder / "a.db"));
}

TEST_CASE("store: checking makes no file, and refuses what open would refuse") {
  const TemporaryFolder folder;
  REQUIRE(SessionStore::check(folder / "new.db"));
  REQUIRE_FALSE(std::filesystem::exists(folder / "new.db"));
  REQUIRE_FALSE(SessionStore::check(folder / "no/such/folder/new.db"));
  folder.write("text.db", std::string(4096, 'x'));
  REQUIRE_FALSE(SessionStore::check(folder / "text.db"));
}

TEST_CASE("store: a file that is no database, of another program or of a newer version is refused by name") {
  const TemporaryFolder folder;
  folder.write("text.db", std::string(4096, 'x'));
  const auto text = SessionStore::open(folder / "text.db");
  REQUIRE_FALSE(text);
  REQUIRE(text.error().exit_status() == 2);
  REQUIRE(text.error().message.find("text.db") != std::string::npos);
  SQLite::Database(folder / "other.db", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE).exec("CREATE TABLE other(a)");
  const auto other = SessionStore::open(folder / "other.db");
  REQUIRE_FALSE(other);
  REQUIRE(other.error().message.find("another program") != std::string::npos);
  open(folder / "newer.db");
  SQLite::Database(folder / "newer.db", SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 99");
  const auto newer = SessionStore::open(folder / "newer.db");
  REQUIRE_FALSE(newer);
  REQUIRE(newer.error().message.find("newer") != std::string::npos);
  const auto nowhere = SessionStore::open(folder / "no/such/folder/a.db");
  REQUIRE_FALSE(nowhere);
  REQUIRE(nowhere.error().exit_status() == 2);
}

}  // namespace imprint
