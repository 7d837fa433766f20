#include "fusion/store/schema.h"

#include <array>

namespace imprint {
namespace {

// Step n leads from schema n to n + 1; a new database takes all of them. What was once released stays as it is.
// tests/data/store holds a database of each version.
constexpr auto kSteps = std::to_array<const char*>({
    R"sql(
CREATE TABLE message (
  id INTEGER PRIMARY KEY,            -- the order of receipt
  session TEXT NOT NULL,
  observation INTEGER NOT NULL,
  received_ns INTEGER NOT NULL,
  camera TEXT,                       -- NULL: a trigger
  boot_id INTEGER,
  sequence INTEGER,
  bytes BLOB NOT NULL
);
CREATE INDEX message_session ON message(session, id);
CREATE UNIQUE INDEX one_imprint ON message(camera, boot_id, sequence) WHERE camera IS NOT NULL;
CREATE UNIQUE INDEX one_trigger ON message(session, observation, bytes) WHERE camera IS NULL;
CREATE TABLE result (
  session TEXT PRIMARY KEY,
  complete INTEGER NOT NULL,
  error TEXT NOT NULL,
  json TEXT NOT NULL,
  made_ns INTEGER NOT NULL,
  revision INTEGER NOT NULL UNIQUE,
  last_message INTEGER NOT NULL      -- newest message of the session when the result was made
);
)sql",
    // late: an imprint whose observation had been evaluated without it. clock_offset_ns: its node's clock minus ours;
    // NULL: not known.
    R"sql(
ALTER TABLE message ADD COLUMN late INTEGER NOT NULL DEFAULT 0;
ALTER TABLE message ADD COLUMN clock_offset_ns INTEGER;
)sql",
    // What a copy elsewhere knows this database by.
    R"sql(
CREATE TABLE identity (store TEXT NOT NULL);
INSERT INTO identity VALUES (lower(hex(randomblob(16))));
)sql",
});

constexpr int kSchemaVersion = static_cast<int>(kSteps.size());

}  // namespace

Result<int> known_version(SQLite::Database& db, const std::filesystem::path& path) {
  const int version = db.execAndGet("PRAGMA user_version").getInt();
  if (version < 0 || version > kSchemaVersion) {
    return invalid_input(
        "{}: written by a newer imprint-fusion (schema {}, this one knows {}); update it or name another file",
        path.string(), version, kSchemaVersion);
  }
  if (version == 0 && db.execAndGet("SELECT count(*) FROM sqlite_master").getInt() > 0) {
    return invalid_input("{}: a database of another program; name another file", path.string());
  }
  return version;
}

Result<void> prepare_schema(SQLite::Database& db, const std::filesystem::path& path) {
  const auto version = known_version(db, path);
  if (!version) return pass_on(version.error());
  if (*version == kSchemaVersion) return {};
  SQLite::Transaction transaction(db);
  for (int step = *version; step < kSchemaVersion; ++step) db.exec(kSteps[static_cast<std::size_t>(step)]);
  db.exec(fmt::format("PRAGMA user_version = {}", kSchemaVersion));
  transaction.commit();
  return {};
}

}  // namespace imprint
