#include <optional>
#include <span>
#include <sstream>

#include <libpq-fe.h>

#include "fusion/history/history_copy.h"
#include "fusion/history/postgres_schema.h"

namespace imprint {
namespace {

struct Closed {
  void operator()(PGconn* connection) const { PQfinish(connection); }
  void operator()(PGresult* result) const { PQclear(result); }
  void operator()(PQconninfoOption* options) const { PQconninfoFree(options); }
};
using Connection = std::unique_ptr<PGconn, Closed>;
using Rows = std::unique_ptr<PGresult, Closed>;

// PostgreSQL's own words as one line.
std::string one_line(const char* message) {
  std::istringstream words(message == nullptr ? "no reason given" : message);
  std::string line;
  for (std::string word; words >> word; line += word) line += line.empty() ? "" : " ";
  return line;
}

/// A statement's parameter: SQL's NULL, a text, or bytes.
class Value {
 public:
  Value(std::nullopt_t) {}      // NOLINT(google-explicit-constructor): lists of values read well
  Value(const char*) = delete;  // it would be a truth
  Value(std::string text) : content_(std::move(text)) {}               // NOLINT(google-explicit-constructor)
  Value(std::int64_t number) : Value(std::to_string(number)) {}        // NOLINT(google-explicit-constructor)
  Value(bool truth) : Value(std::string(truth ? "true" : "false")) {}  // NOLINT(google-explicit-constructor)
  Value(std::span<const std::uint8_t> bytes)                           // NOLINT(google-explicit-constructor)
      : content_(std::string(bytes.begin(), bytes.end())), is_bytes_(true) {}

  [[nodiscard]] const char* data() const { return content_ ? content_->data() : nullptr; }
  [[nodiscard]] int size() const { return content_ ? static_cast<int>(content_->size()) : 0; }
  [[nodiscard]] bool is_bytes() const { return is_bytes_; }

 private:
  std::optional<std::string> content_;
  bool is_bytes_ = false;
};

class PostgresCopy final : public HistoryCopy {
 public:
  explicit PostgresCopy(std::string where) : where_(std::move(where)) {}

  Result<HistoryEnd> connect(const HistorySource& source) override {
    source_ = source;
    if (auto opened = open(); !opened) return pass_on(opened.error());
    if (auto prepared = in_transaction([this] { return prepare(); }); !prepared) return pass_on(prepared.error());
    auto rows =
        run("SELECT coalesce(max(id), 0), coalesce((SELECT received_ns FROM imprint.message WHERE store = $1 "
            "ORDER BY id DESC LIMIT 1), 0), (SELECT coalesce(max(revision), 0) FROM imprint.result WHERE store = $1) "
            "FROM imprint.message WHERE store = $1",
            {source_.store});
    if (!rows) return pass_on(rows.error());
    const auto number = [&](int column) { return std::stoll(PQgetvalue(rows->get(), 0, column)); };
    return HistoryEnd{{number(0), number(2)}, number(1)};
  }

  Result<void> add(const std::vector<StoredMessage>& messages, const std::vector<StoredResult>& results) override {
    return in_transaction([&]() -> Result<void> {
      for (const StoredMessage& message : messages)
        if (auto added = add(message); !added) return added;
      for (const StoredResult& result : results)
        if (auto added = add(result); !added) return added;
      return {};
    });
  }

 private:
  // What the connection string itself says comes after these, and counts.
  Result<void> open() {
    const char* const keys[] = {"fallback_application_name",
                                "connect_timeout",
                                "tcp_user_timeout",
                                "keepalives_idle",
                                "client_encoding",
                                "dbname",
                                nullptr};
    const char* const values[] = {"imprint-fusion", "5", "10000", "10", "UTF8", where_.c_str(), nullptr};
    connection_.reset(PQconnectdbParams(keys, values, 1));
    if (PQstatus(connection_.get()) != CONNECTION_OK) return failed(PQerrorMessage(connection_.get()));
    PQsetNoticeProcessor(
        connection_.get(), [](void*, const char*) {}, nullptr);
    return {};
  }

  // One fusion process at a time, whatever else it holds.
  Result<void> prepare() {
    if (auto locked = run("SELECT pg_advisory_xact_lock(hashtext('imprint.version'))"); !locked)
      return pass_on(locked.error());
    auto there = run("SELECT to_regclass('imprint.version') IS NOT NULL");
    if (!there) return pass_on(there.error());
    if (*PQgetvalue(there->get(), 0, 0) == 'f') {
      const Rows made(PQexec(connection_.get(), kPostgresSchema));
      if (auto good = check(made); !good) return good;
    }
    auto version = run("SELECT max(number) FROM imprint.version");
    if (!version) return pass_on(version.error());
    if (const std::string found = PQgetvalue(version->get(), 0, 0); found != std::to_string(kPostgresSchemaVersion))
      return failed(fmt::format("written by a newer imprint-fusion (schema {}, this one knows {}); update it", found,
                                kPostgresSchemaVersion));
    return run("INSERT INTO imprint.store (store, site, line) VALUES ($1, $2, $3) ON CONFLICT (store) DO UPDATE "
               "SET site = excluded.site, line = excluded.line",
               {source_.store, source_.site, source_.line})
        .map([](const Rows&) {});
  }

  Result<void> add(const StoredMessage& message) {
    const bool imprint = !message.is_trigger;
    const auto& offset_ns = message.reception.clock_offset_ns;
    return run("INSERT INTO imprint.message (store, id, session, observation, received_ns, camera, boot_id, sequence, "
               "late, clock_offset_ns, bytes) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11) "
               "ON CONFLICT DO NOTHING",
               {source_.store, message.id, message.session, message.observation, message.reception.received_ns,
                imprint ? Value(message.camera_id) : std::nullopt,
                imprint ? Value(fmt::format("{:016x}", message.boot_id)) : std::nullopt,
                imprint ? Value(std::to_string(message.sequence)) : std::nullopt, message.reception.late,
                offset_ns ? Value(*offset_ns) : std::nullopt, Value(std::span(message.bytes))})
        .map([](const Rows&) {});
  }

  Result<void> add(const StoredResult& result) {
    return run("INSERT INTO imprint.result AS had (store, session, complete, error, result, made_ns, revision) "
               "VALUES ($1, $2, $3, $4, $5, $6, $7) ON CONFLICT (store, session) DO UPDATE SET "
               "complete = excluded.complete, error = excluded.error, result = excluded.result, "
               "made_ns = excluded.made_ns, revision = excluded.revision WHERE had.revision < excluded.revision",
               {source_.store, result.session, result.complete, result.error,
                result.json.empty() ? std::nullopt : Value(result.json), result.made_ns, result.revision})
        .map([](const Rows&) {});
  }

  template <class Work>
  Result<void> in_transaction(Work&& work) {
    if (auto begun = run("BEGIN"); !begun) return pass_on(begun.error());
    if (auto done = work(); !done) {
      (void)run("ROLLBACK");
      return done;
    }
    return run("COMMIT").map([](const Rows&) {});
  }

  Result<Rows> run(const char* statement, const std::vector<Value>& parameters = {}) {
    std::vector<const char*> data;
    std::vector<int> sizes;
    std::vector<int> formats;
    for (const Value& value : parameters) {
      data.push_back(value.data());
      sizes.push_back(value.size());
      formats.push_back(value.is_bytes() ? 1 : 0);
    }
    Rows rows(PQexecParams(connection_.get(), statement, static_cast<int>(parameters.size()), nullptr, data.data(),
                           sizes.data(), formats.data(), 0));
    if (auto good = check(rows); !good) return pass_on(good.error());
    return rows;
  }

  Result<void> check(const Rows& rows) {
    const ExecStatusType status = PQresultStatus(rows.get());
    if (status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK) return {};
    return failed(PQerrorMessage(connection_.get()));
  }

  Result<void> failed(const std::string& why) { return job_failed("PostgreSQL: {}", one_line(why.c_str())); }

  std::string where_;
  HistorySource source_;
  Connection connection_;
};

}  // namespace

Result<void> check_postgres(const std::string& where) {
  char* message = nullptr;
  const std::unique_ptr<PQconninfoOption, Closed> options(PQconninfoParse(where.c_str(), &message));
  if (!options) {
    std::string why = one_line(message);
    PQfreemem(message);
    return invalid_input("expected postgresql://[user@]host[:port]/database or key=value words: {}", why);
  }
  for (const PQconninfoOption* option = options.get(); option->keyword != nullptr; ++option) {
    if (std::string_view(option->keyword) == "password" && option->val != nullptr)
      return invalid_input(
          "a password does not belong here: name a passfile or a service, or let PostgreSQL know the user by peer or "
          "certificate");
  }
  return {};
}

std::unique_ptr<HistoryCopy> postgres_copy(const std::string& where) { return std::make_unique<PostgresCopy>(where); }

}  // namespace imprint
