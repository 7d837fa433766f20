#include "fusion/history/history_export.h"

#include <atomic>
#include <map>

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

// A database in memory, which outlives the connections to it.
struct Elsewhere {
  struct Rows {
    std::map<std::int64_t, StoredMessage> messages;
    std::map<std::string, StoredResult> results;
  };
  std::mutex mutex;
  std::map<std::string, Rows> stores;
  int added_twice = 0;
  std::atomic<bool> away = false;
  bool fails_after_writing = false;  // the answer to COMMIT is lost

  Rows of(const std::string& store) {
    const std::lock_guard lock(mutex);
    return stores[store];
  }
};

class CopyElsewhere final : public HistoryCopy {
 public:
  explicit CopyElsewhere(Elsewhere& there) : there_(there) {}

  Result<HistoryEnd> connect(const HistorySource& source) override {
    const std::lock_guard lock(there_.mutex);
    if (there_.away) return job_failed("away");
    rows_ = &there_.stores[source.store];
    HistoryEnd end;
    if (!rows_->messages.empty()) {
      end.position.message = rows_->messages.rbegin()->first;
      end.received_ns = rows_->messages.rbegin()->second.reception.received_ns;
    }
    for (const auto& [session, result] : rows_->results)
      end.position.revision = std::max(end.position.revision, result.revision);
    return end;
  }

  Result<void> add(const std::vector<StoredMessage>& messages, const std::vector<StoredResult>& results) override {
    const std::lock_guard lock(there_.mutex);
    if (there_.away) return job_failed("away");
    for (const auto& message : messages) {
      if (!rows_->messages.emplace(message.id, message).second) ++there_.added_twice;
    }
    for (const auto& result : results) rows_->results[result.session] = result;
    if (std::exchange(there_.fails_after_writing, false)) return job_failed("connection lost");
    return {};
  }

 private:
  Elsewhere& there_;
  Elsewhere::Rows* rows_ = nullptr;
};

struct Fixture {
  TemporaryFolder folder;
  std::unique_ptr<SessionStore> store = *SessionStore::open(folder / "a.db");
  LineBoard board{{"plant", "L1", "best", "0"}, {"cam1"}, std::chrono::steady_clock::now()};
  Elsewhere there;
  std::uint64_t sequence = 0;

  void measure(const std::string& session, std::int64_t received_ns = 1) {
    Imprint imprint;
    imprint.camera_id = "cam1";
    imprint.session = session;
    imprint.sequence = ++sequence;
    REQUIRE(*store->add_imprint(imprint, Bytes{1, 0, 2}, {received_ns}));
    REQUIRE(store->put_result({session, true, "", R"({"length_mm": 1.5})", 5, 0}));
  }
  std::unique_ptr<HistoryExport> start() {
    return std::make_unique<HistoryExport>(std::make_unique<CopyElsewhere>(there), "plant", "L1", *store, board,
                                           HistoryExport::Waits{.idle = 2ms, .retry = 2ms});
  }
  nlohmann::json status() { return board.status(std::chrono::steady_clock::now()); }
  template <class Condition>
  void wait_for(Condition&& condition) {
    const auto until = std::chrono::steady_clock::now() + 20s;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > until) FAIL("not within 20 s: " << status().dump());
      std::this_thread::sleep_for(1ms);
    }
  }
  void wait_for_all() {
    wait_for([&] {
      const auto rows = there.of(*store->identity());
      return rows.messages.size() == sequence && !rows.results.empty() && !board.has_alarm();
    });
  }
};

}  // namespace

TEST_CASE("history: what was there before, and what comes, is copied as it is") {
  Fixture line;
  for (int i = 0; i < 450; ++i) line.measure("S" + std::to_string(i));  // more than two batches
  const auto copying = line.start();
  line.wait_for([&] { return line.there.of(*line.store->identity()).results.size() == 450; });
  line.measure("later");
  line.wait_for([&] { return line.there.of(*line.store->identity()).results.size() == 451; });
  const auto rows = line.there.of(*line.store->identity());
  CHECK(rows.messages.size() == 451);
  CHECK(rows.messages.begin()->second.bytes == Bytes{1, 0, 2});
  CHECK(rows.results.at("later").json == R"({"length_mm": 1.5})");
  CHECK(line.there.added_twice == 0);
  line.wait_for([&] { return line.status()["counters"]["copied"] == 902; });
  line.wait_for([&] {
    return line.status()["history"] ==
           nlohmann::json{{"connected", true}, {"waiting_messages", 0}, {"waiting_results", 0}};
  });
}

TEST_CASE("history: a copy out of reach is an alarm, counts what waits, and catches up") {
  Fixture line;
  line.there.away = true;
  const auto copying = line.start();
  line.measure("S1");
  line.measure("S2");
  line.wait_for([&] { return line.status()["history"]["waiting_messages"] == 2; });
  auto status = line.status();
  CHECK(status["history"]["connected"] == false);
  CHECK(status["alarms"][0]["name"] == "history");
  CHECK(status["alarms"][0]["text"] == "away");
  line.there.away = false;
  line.wait_for_all();
  CHECK(line.status()["history"]["connected"] == true);
  CHECK(line.there.of(*line.store->identity()).results.size() == 2);
}

TEST_CASE("history: a batch that was written though its answer was lost is not written twice") {
  Fixture line;
  line.measure("S1");
  line.there.fails_after_writing = true;
  const auto copying = line.start();
  line.wait_for_all();
  line.measure("S2");
  line.wait_for_all();
  CHECK(line.there.added_twice == 0);
}

TEST_CASE("history: a copy that was put back to an older state is filled up again") {
  Fixture line;
  for (int i = 0; i < 5; ++i) line.measure("S" + std::to_string(i));
  {
    const auto copying = line.start();
    line.wait_for_all();
  }
  auto& rows = line.there.stores[*line.store->identity()];
  rows.messages.erase(rows.messages.find(3), rows.messages.end());
  std::erase_if(rows.results, [](const auto& entry) { return entry.second.revision >= 3; });
  const auto copying = line.start();
  line.wait_for([&] { return line.there.of(*line.store->identity()).results.size() == 5; });
  line.wait_for_all();
}

TEST_CASE("history: a database put back to an older state is copied anew, and nothing of it is taken for known") {
  Fixture line;
  line.measure("S1", 1);
  std::filesystem::copy_file(line.folder / "a.db", line.folder / "backup.db");
  if (std::filesystem::exists(line.folder / "a.db-wal"))
    std::filesystem::copy_file(line.folder / "a.db-wal", line.folder / "backup.db-wal");
  line.measure("S2", 2);
  {
    const auto copying = line.start();
    line.wait_for([&] { return line.there.of(*line.store->identity()).results.size() == 2; });
  }
  const auto former = *line.store->identity();
  line.store = *SessionStore::open(line.folder / "backup.db");
  REQUIRE(*line.store->identity() == former);
  SECTION("which has less than the copy") {}
  SECTION("which has gone on since, to another message of the same number") { line.measure("S3", 3); }
  const auto copying = line.start();
  line.wait_for([&] { return *line.store->identity() != former; });
  const auto expected = line.store->newest()->message;
  line.wait_for(
      [&] { return static_cast<std::int64_t>(line.there.of(*line.store->identity()).messages.size()) == expected; });
  CHECK(line.there.of(former).messages.size() == 2);
}

}  // namespace imprint
