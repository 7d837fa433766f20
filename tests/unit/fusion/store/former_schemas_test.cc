#include <fstream>
#include <iterator>

#include <SQLiteCpp/SQLiteCpp.h>
#include <catch2/catch.hpp>

#include "fusion/store/session_store.h"
#include "tests/unit/temporary_folder.h"

// tests/data/store/schema<N>.sql: what the program of that schema version wrote, dumped. Three sessions: F-0001 with a
// result and two imprints (one of them with curves), F-0002 with a late imprint after its result, F-0003 just
// triggered.
namespace imprint {
namespace {

std::filesystem::path dump_of(int version) {
  return std::filesystem::path(IMPRINT_TEST_DATA) / "store" / fmt::format("schema{}.sql", version);
}

std::filesystem::path database_of(int version, const TemporaryFolder& folder) {
  std::ifstream dump(dump_of(version));
  const std::string sql(std::istreambuf_iterator<char>(dump), {});
  const auto path = folder / fmt::format("schema{}.db", version);
  SQLite::Database(path, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE).exec(sql);
  return path;
}

int version_of(const std::filesystem::path& path) {
  return SQLite::Database(path).execAndGet("PRAGMA user_version").getInt();
}

int newest_version() {
  const TemporaryFolder folder;
  REQUIRE(SessionStore::open(folder / "new.db"));
  return version_of(folder / "new.db");
}

// A database's tables and columns, whatever order they were made in.
std::vector<std::string> columns_of(const std::filesystem::path& path) {
  SQLite::Database db(path);
  SQLite::Statement select(db,
                           "SELECT t.name || '.' || c.name || ' ' || c.type || ' ' || c.\"notnull\" "
                           "FROM sqlite_master t, pragma_table_info(t.name) c ORDER BY 1");
  std::vector<std::string> columns;
  while (select.executeStep()) columns.push_back(select.getColumn(0).getString());
  return columns;
}

}  // namespace

TEST_CASE("store: a database of every schema version there was is taken over with all it holds") {
  const TemporaryFolder folder;
  const int newest = newest_version();
  for (int version = 1; version <= newest; ++version) {
    CAPTURE(version);
    REQUIRE(std::filesystem::exists(dump_of(version)));  // a new schema comes with its database
    const auto path = database_of(version, folder);
    REQUIRE(version_of(path) == version);
    REQUIRE(SessionStore::check(path));
    REQUIRE(version_of(path) == version);  // a check changes nothing
    {
      auto store = *SessionStore::open(path);
      const auto sessions = *store->sessions(10);
      REQUIRE(sessions.size() == 2);
      CHECK(sessions[0].session == "F-0002");
      CHECK(sessions[0].error == "session F-0002: fewer than two cameras");
      CHECK(sessions[1].complete);
      CHECK(sessions[1].length_mm == 2310.25);
      CHECK(sessions[1].made_ns == 1'760'000'000'000'000'300);
      CHECK(*store->unevaluated() == std::vector<std::string>{"F-0002", "F-0003"});

      const auto messages = *store->messages("F-0001");
      REQUIRE(messages.size() == 3);
      CHECK(decode_trigger(messages[0].bytes)->rotation_deg == 60.0);
      const auto imprint = decode_imprint(messages[1].bytes);
      REQUIRE(imprint);
      CHECK(imprint->boot_id == 0xfedcba9876543210U);
      CHECK(imprint->upper.offset_px.size() == 60);
      CHECK(decode_imprint(messages[2].bytes)->failure == "no forging found");
      CHECK(store->messages("F-0002")->back().reception.late == (version >= 2));
      CHECK(store->identity()->size() == 32);
      // What it knew it still knows, and what is new it takes.
      CHECK_FALSE(*store->add_imprint(*imprint, messages[1].bytes, {1}));
      Imprint other = *imprint;
      other.sequence = 99;
      CHECK(*store->add_imprint(other, encode_imprint(other), {2, true, 7}));
      CHECK(*store->put_result({"F-0003", true, "", R"({"length_mm": 1.0})", 5, 0}) == 3);
    }
    CHECK(version_of(path) == newest);
    CHECK(SQLite::Database(path).execAndGet("PRAGMA integrity_check").getString() == "ok");
    REQUIRE(SessionStore::open(folder / "today.db"));
    CHECK(columns_of(path) == columns_of(folder / "today.db"));
  }
}

TEST_CASE("store: a database of the future is refused with one line and left as it is") {
  const TemporaryFolder folder;
  const int newest = newest_version();
  const auto path = database_of(newest, folder);
  SQLite::Database(path, SQLite::OPEN_READWRITE).exec(fmt::format("PRAGMA user_version = {}", newest + 1));
  for (const auto& refused : {SessionStore::open(path).map([](const auto&) {}), SessionStore::check(path)}) {
    REQUIRE_FALSE(refused);
    CHECK(refused.error().exit_status() == 2);
    CHECK(refused.error().message.find(fmt::format("(schema {}, this one knows {})", newest + 1, newest)) !=
          std::string::npos);
    CHECK(refused.error().message.find('\n') == std::string::npos);
  }
  CHECK(version_of(path) == newest + 1);
}

}  // namespace imprint
