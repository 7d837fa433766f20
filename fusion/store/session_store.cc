#include "fusion/store/session_store.h"

#include <mutex>
#include <utility>

#include <SQLiteCpp/SQLiteCpp.h>

#include "fusion/store/schema.h"
#include "lib/config/file_lock.h"

namespace imprint {
namespace {

constexpr int kBusyTimeoutMs = 2000;  // another process reading (a report, a backup) may hold the file for a moment

StoredResult read_result(const SQLite::Statement& row) {
  StoredResult result;
  result.session = row.getColumn(0).getString();
  result.complete = row.getColumn(1).getInt() != 0;
  result.error = row.getColumn(2).getString();
  result.json = row.getColumn(3).getString();
  result.made_ns = row.getColumn(4).getInt64();
  result.revision = row.getColumn(5).getInt64();
  return result;
}

constexpr const char* kSelectResult = "SELECT session, complete, error, json, made_ns, revision FROM result ";

constexpr const char* kSelectMessage =
    "SELECT id, session, observation, camera, boot_id, sequence, received_ns, bytes, late, clock_offset_ns "
    "FROM message ";

std::vector<StoredMessage> read_messages(SQLite::Statement& select) {
  std::vector<StoredMessage> messages;
  while (select.executeStep()) {
    StoredMessage message;
    message.id = select.getColumn(0).getInt64();
    message.session = select.getColumn(1).getString();
    message.observation = select.getColumn(2).getInt64();
    message.is_trigger = select.isColumnNull(3);
    if (!message.is_trigger) {
      message.camera_id = select.getColumn(3).getString();
      message.boot_id = static_cast<std::uint64_t>(select.getColumn(4).getInt64());
      message.sequence = static_cast<std::uint64_t>(select.getColumn(5).getInt64());
    }
    message.reception.received_ns = select.getColumn(6).getInt64();
    const SQLite::Column blob = select.getColumn(7);
    const auto* bytes = static_cast<const std::uint8_t*>(blob.getBlob());
    message.bytes.assign(bytes, bytes + blob.getBytes());
    message.reception.late = select.getColumn(8).getInt() != 0;
    if (!select.isColumnNull(9)) message.reception.clock_offset_ns = select.getColumn(9).getInt64();
    messages.push_back(std::move(message));
  }
  return messages;
}

class SqliteStore final : public SessionStore {
 public:
  SqliteStore(const std::filesystem::path& path, FileLock lock)
      : path_(path),
        lock_(std::move(lock)),
        db_(path.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE, kBusyTimeoutMs) {}

  Result<void> prepare() {
    if (auto prepared = prepare_schema(db_, path_); !prepared) return prepared;
    db_.exec("PRAGMA journal_mode = WAL");
    db_.exec("PRAGMA synchronous = FULL");
    return {};
  }

  Result<bool> add_imprint(const Imprint& imprint, std::span<const std::uint8_t> bytes,
                           const Reception& reception) override {
    return guarded<bool>([&] {
      SQLite::Statement insert(
          db_,
          "INSERT OR IGNORE INTO message(session, observation, received_ns, camera, boot_id, sequence, bytes, "
          "late, clock_offset_ns) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)");
      insert.bind(4, imprint.camera_id);
      insert.bind(5, static_cast<std::int64_t>(imprint.boot_id));  // the same 64 bits
      insert.bind(6, static_cast<std::int64_t>(imprint.sequence));
      insert.bind(8, reception.late ? 1 : 0);
      if (reception.clock_offset_ns) insert.bind(9, *reception.clock_offset_ns);
      return run_insert(insert, imprint.session, imprint.observation, reception.received_ns, bytes, 7);
    });
  }

  Result<bool> add_trigger(const Trigger& trigger, std::span<const std::uint8_t> bytes,
                           std::int64_t received_ns) override {
    return guarded<bool>([&] {
      SQLite::Statement insert(
          db_, "INSERT OR IGNORE INTO message(session, observation, received_ns, bytes) VALUES (?, ?, ?, ?)");
      return run_insert(insert, trigger.session, trigger.observation, received_ns, bytes, 4);
    });
  }

  Result<std::int64_t> put_result(const StoredResult& result) override {
    return guarded<std::int64_t>([&] {
      SQLite::Transaction transaction(db_, SQLite::TransactionBehavior::IMMEDIATE);
      SQLite::Statement put(db_, R"sql(
INSERT INTO result(session, complete, error, json, made_ns, revision, last_message)
VALUES (?1, ?2, ?3, ?4, ?5, (SELECT ifnull(max(revision), 0) + 1 FROM result),
        (SELECT ifnull(max(id), 0) FROM message WHERE session = ?1))
ON CONFLICT(session) DO UPDATE SET
  made_ns = excluded.made_ns, revision = excluded.revision,
  complete = excluded.complete, error = excluded.error, json = excluded.json
WHERE complete <> excluded.complete OR error <> excluded.error OR json <> excluded.json)sql");
      put.bind(1, result.session);
      put.bind(2, result.complete ? 1 : 0);
      put.bind(3, result.error);
      put.bind(4, result.json);
      put.bind(5, result.made_ns);
      put.exec();
      SQLite::Statement evaluated(
          db_,
          "UPDATE result SET last_message = (SELECT ifnull(max(id), 0) FROM message WHERE session = ?1) "
          "WHERE session = ?1 RETURNING revision");
      evaluated.bind(1, result.session);
      evaluated.executeStep();
      const std::int64_t revision = evaluated.getColumn(0).getInt64();
      evaluated.reset();
      transaction.commit();
      return revision;
    });
  }

  Result<std::optional<StoredResult>> result(const std::string& session) override {
    return guarded<std::optional<StoredResult>>([&]() -> std::optional<StoredResult> {
      SQLite::Statement select(db_, std::string(kSelectResult) + "WHERE session = ?");
      select.bind(1, session);
      return select.executeStep() ? std::optional(read_result(select)) : std::nullopt;
    });
  }

  Result<std::int64_t> revision(const std::string& session) override {
    return guarded<std::int64_t>([&] {
      SQLite::Statement select(db_, "SELECT ifnull(max(revision), 0) FROM result WHERE session = ?");
      select.bind(1, session);
      select.executeStep();
      return select.getColumn(0).getInt64();
    });
  }

  Result<std::optional<StoredResult>> latest_result() override {
    return guarded<std::optional<StoredResult>>([&]() -> std::optional<StoredResult> {
      SQLite::Statement select(db_, std::string(kSelectResult) + "ORDER BY revision DESC LIMIT 1");
      return select.executeStep() ? std::optional(read_result(select)) : std::nullopt;
    });
  }

  Result<std::vector<SessionSummary>> sessions(int limit) override {
    return guarded<std::vector<SessionSummary>>([&] {
      SQLite::Statement select(db_, R"sql(
SELECT session, complete, error, made_ns, revision,
       CASE WHEN json <> '' THEN json_extract(json, '$.length_mm') END,
       CASE WHEN json <> '' THEN json_extract(json, '$.max_deflection_mm') END,
       CASE WHEN json <> '' THEN json_array_length(json, '$.observations') ELSE 0 END
FROM result ORDER BY revision DESC LIMIT ?)sql");
      select.bind(1, limit);
      std::vector<SessionSummary> summaries;
      while (select.executeStep()) {
        SessionSummary summary{select.getColumn(0).getString(),
                               select.getColumn(1).getInt() != 0,
                               select.getColumn(2).getString(),
                               select.getColumn(3).getInt64(),
                               select.getColumn(4).getInt64(),
                               {},
                               {},
                               select.getColumn(7).getInt64()};
        if (!select.isColumnNull(5)) summary.length_mm = select.getColumn(5).getDouble();
        if (!select.isColumnNull(6)) summary.max_deflection_mm = select.getColumn(6).getDouble();
        summaries.push_back(std::move(summary));
      }
      return summaries;
    });
  }

  Result<bool> knows(const std::string& session) override {
    return guarded<bool>([&] {
      SQLite::Statement select(db_, "SELECT EXISTS(SELECT 1 FROM message WHERE session = ?)");
      select.bind(1, session);
      select.executeStep();
      return select.getColumn(0).getInt() != 0;
    });
  }

  Result<std::vector<std::string>> unfinished(int limit) override {
    return guarded<std::vector<std::string>>([&] {
      SQLite::Statement select(db_, R"sql(
SELECT session FROM (
  SELECT message.session AS session, max(message.id) AS newest
  FROM message LEFT JOIN result ON result.session = message.session
  WHERE result.session IS NULL OR result.complete = 0
     OR message.id > result.last_message
  GROUP BY message.session ORDER BY newest DESC LIMIT ?)
ORDER BY newest)sql");
      select.bind(1, limit);
      std::vector<std::string> names;
      while (select.executeStep()) names.push_back(select.getColumn(0).getString());
      return names;
    });
  }

  Result<std::vector<std::string>> unevaluated() override {
    return guarded<std::vector<std::string>>([&] {
      SQLite::Statement select(db_, R"sql(
SELECT newest.session FROM (SELECT session, max(id) AS id FROM message GROUP BY session) AS newest
LEFT JOIN result ON result.session = newest.session
WHERE result.session IS NULL OR newest.id > result.last_message
ORDER BY newest.id)sql");
      std::vector<std::string> names;
      while (select.executeStep()) names.push_back(select.getColumn(0).getString());
      return names;
    });
  }

  Result<std::vector<std::pair<std::uint64_t, std::uint64_t>>> sequences(const std::string& camera_id,
                                                                         int starts) override {
    return guarded<std::vector<std::pair<std::uint64_t, std::uint64_t>>>([&] {
      SQLite::Statement select(db_, R"sql(
SELECT message.boot_id, message.sequence
FROM (SELECT boot_id, max(id) AS newest FROM message WHERE camera = ?1 GROUP BY boot_id
      ORDER BY newest DESC LIMIT ?2) AS start
JOIN message ON message.camera = ?1 AND message.boot_id = start.boot_id
ORDER BY start.newest, message.sequence)sql");
      select.bind(1, camera_id);
      select.bind(2, starts);
      std::vector<std::pair<std::uint64_t, std::uint64_t>> numbers;
      while (select.executeStep()) {
        numbers.emplace_back(static_cast<std::uint64_t>(select.getColumn(0).getInt64()),
                             static_cast<std::uint64_t>(select.getColumn(1).getInt64()));
      }
      return numbers;
    });
  }

  Result<std::vector<StoredMessage>> messages(const std::string& session) override {
    return guarded<std::vector<StoredMessage>>([&] {
      SQLite::Statement select(db_, std::string(kSelectMessage) + "WHERE session = ? ORDER BY id");
      select.bind(1, session);
      return read_messages(select);
    });
  }

  Result<std::string> identity() override {
    return guarded<std::string>([&] { return db_.execAndGet("SELECT store FROM identity").getString(); });
  }

  Result<void> renew_identity() override {
    return guarded<int>([&] { return db_.exec("UPDATE identity SET store = lower(hex(randomblob(16)))"); })
        .map([](int) {});
  }

  Result<std::vector<StoredMessage>> messages_after(std::int64_t id, int limit) override {
    return guarded<std::vector<StoredMessage>>([&] {
      SQLite::Statement select(db_, std::string(kSelectMessage) + "WHERE id > ? ORDER BY id LIMIT ?");
      select.bind(1, id);
      select.bind(2, limit);
      return read_messages(select);
    });
  }

  Result<std::vector<StoredResult>> results_after(std::int64_t revision, int limit) override {
    return guarded<std::vector<StoredResult>>([&] {
      SQLite::Statement select(db_, std::string(kSelectResult) + "WHERE revision > ? ORDER BY revision LIMIT ?");
      select.bind(1, revision);
      select.bind(2, limit);
      std::vector<StoredResult> results;
      while (select.executeStep()) results.push_back(read_result(select));
      return results;
    });
  }

  Result<HistoryPosition> newest() override {
    return guarded<HistoryPosition>([&] {
      SQLite::Statement select(db_, R"sql(
SELECT ifnull((SELECT max(id) FROM message), 0), ifnull((SELECT max(revision) FROM result), 0))sql");
      select.executeStep();
      return HistoryPosition{select.getColumn(0).getInt64(), select.getColumn(1).getInt64()};
    });
  }

 private:
  // One call at a time, and no exception of the library leaves this file.
  template <class T, class Call>
  Result<T> guarded(Call&& call) {
    const std::lock_guard lock(mutex_);
    try {
      return call();
    } catch (const SQLite::Exception& error) {
      return job_failed("{}: {}", path_.string(), error.what());
    }
  }

  static bool run_insert(SQLite::Statement& insert, const std::string& session, std::uint32_t observation,
                         std::int64_t received_ns, std::span<const std::uint8_t> bytes, int bytes_column) {
    insert.bind(1, session);
    insert.bind(2, static_cast<std::int64_t>(observation));
    insert.bind(3, received_ns);
    insert.bind(bytes_column, static_cast<const void*>(bytes.data()), static_cast<int>(bytes.size()));
    return insert.exec() > 0;
  }

  std::filesystem::path path_;
  FileLock lock_;  // two fusion nodes on one file would each announce results without the other's imprints
  std::mutex mutex_;
  SQLite::Database db_;
};

}  // namespace

Result<std::unique_ptr<SessionStore>> SessionStore::open(const std::filesystem::path& path) {
  // Beside the file: SQLite locks the file itself, and loses its locks when another descriptor of it is closed.
  const std::string lock_path = path.string() + ".lock";
  auto lock = FileLock::take(
      lock_path,
      fmt::format(
          "{}: in use by another imprint-fusion (it holds {}); stop that one, or name another file as fusion.database",
          path.string(), lock_path));
  if (!lock) return pass_on(lock.error());
  try {
    auto store = std::make_unique<SqliteStore>(path, std::move(*lock));
    if (auto ready = store->prepare(); !ready) return pass_on(ready.error());
    return store;
  } catch (const SQLite::Exception& error) {
    return invalid_input("{}: cannot be opened as a database: {}", path.string(), error.what());
  }
}

Result<void> SessionStore::check(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    if (std::filesystem::is_directory(path.parent_path(), ignored)) return {};
    return invalid_input("{}: the folder does not exist", path.string());
  }
  try {
    SQLite::Database db(path.string(), SQLite::OPEN_READONLY, kBusyTimeoutMs);
    if (const auto version = known_version(db, path); !version) return pass_on(version.error());
    return {};
  } catch (const SQLite::Exception& error) {
    return invalid_input("{}: cannot be opened as a database: {}", path.string(), error.what());
  }
}

}  // namespace imprint
