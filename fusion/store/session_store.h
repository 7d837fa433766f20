#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "lib/imprint/imprint.h"
#include "lib/result/result.h"
#include "lib/wire/wire.h"

namespace imprint {

/// A session's result as it stands on disk.
struct StoredResult {
  std::string session;
  bool complete = false;
  std::string error;          ///< why there is no measurement; empty when there is
  std::string json;           ///< `imprint.result/1`; empty when there is no measurement
  std::int64_t made_ns = 0;   ///< since the Unix epoch
  std::int64_t revision = 0;  ///< counts every result of every session, from 1
};

/// One line of the list of sessions; figures are absent when there is no measurement.
struct SessionSummary {
  std::string session;
  bool complete = false;
  std::string error;
  std::int64_t made_ns = 0;
  std::int64_t revision = 0;
  std::optional<double> length_mm;
  std::optional<double> max_deflection_mm;
  std::int64_t observations = 0;
};

/// What else is to be remembered of an imprint's arrival.
struct Reception {
  std::int64_t received_ns = 0;                   ///< since the Unix epoch
  bool late = false;                              ///< its observation had been evaluated without it
  std::optional<std::int64_t> clock_offset_ns{};  ///< the node's clock minus fusion's, where it was known
};

/// A message as it was received.
struct StoredMessage {
  std::int64_t id = 0;  ///< grows in the order of receipt
  std::string session;
  std::int64_t observation = 0;
  bool is_trigger = false;  ///< else an imprint
  std::string camera_id;    ///< of an imprint, as the next two
  std::uint64_t boot_id = 0;
  std::uint64_t sequence = 0;
  Reception reception;              ///< of a trigger only the time
  std::vector<std::uint8_t> bytes;  ///< as they came over the wire
};

/// How far a history reaches: its newest message and its newest result, 0 where there is none.
struct HistoryPosition {
  std::int64_t message = 0;   ///< StoredMessage::id
  std::int64_t revision = 0;  ///< StoredResult::revision
};

/// What fusion must not lose: every trigger and imprint as received, and each session's latest result, in one SQLite
/// file. A call that returns has its data on disk (write-ahead log, synchronous FULL); a process killed at any moment
/// leaves a file that opens again without repair. Safe to use from several threads.
class SessionStore {
 public:
  /// Opens or creates the file. Fails (invalid_input) when another program has it open as its store, when it cannot be
  /// opened, is no such database or was written by a newer version.
  static Result<std::unique_ptr<SessionStore>> open(const std::filesystem::path& path);
  /// Whether `open` would find a database it can use, or a place to make one. Changes nothing; the file may be in use.
  static Result<void> check(const std::filesystem::path& path);
  virtual ~SessionStore() = default;

  /// False when this imprint (camera, boot, sequence) is already stored. All writes fail (job_failed) with the
  /// database's own words, e.g. when the disk is full, and have then changed nothing.
  virtual Result<bool> add_imprint(const Imprint& imprint, std::span<const std::uint8_t> bytes,
                                   const Reception& reception) = 0;
  /// False when the same trigger is already stored.
  virtual Result<bool> add_trigger(const Trigger& trigger, std::span<const std::uint8_t> bytes,
                                   std::int64_t received_ns) = 0;
  /// Replaces the session's result and gives its revision; the old one's when nothing but `made_ns` is new.
  virtual Result<std::int64_t> put_result(const StoredResult& result) = 0;

  virtual Result<std::optional<StoredResult>> result(const std::string& session) = 0;
  virtual Result<std::optional<StoredResult>> latest_result() = 0;
  /// Of the session's result; 0 when there is none.
  virtual Result<std::int64_t> revision(const std::string& session) = 0;
  /// Newest first.
  virtual Result<std::vector<SessionSummary>> sessions(int limit) = 0;
  virtual Result<bool> knows(const std::string& session) = 0;
  /// Sessions whose result is not complete or older than their newest imprint; the newest `limit`, oldest first.
  virtual Result<std::vector<std::string>> unfinished(int limit) = 0;
  /// Sessions with a message that no result has taken in yet, oldest first.
  virtual Result<std::vector<std::string>> unevaluated() = 0;
  /// Boot id and sequence of a camera's stored imprints, of its newest `starts` starts; by start, oldest first.
  virtual Result<std::vector<std::pair<std::uint64_t, std::uint64_t>>> sequences(const std::string& camera_id,
                                                                                 int starts) = 0;
  /// All messages of a session in the order they were received.
  virtual Result<std::vector<StoredMessage>> messages(const std::string& session) = 0;

  /// What a copy elsewhere knows this database by; made with it.
  virtual Result<std::string> identity() = 0;
  /// The database is another one from now on: it was put back to an older state than its copies have.
  virtual Result<void> renew_identity() = 0;
  /// Messages newer than `id`, of all sessions, the oldest `limit`.
  virtual Result<std::vector<StoredMessage>> messages_after(std::int64_t id, int limit) = 0;
  /// Results as they stand now with a revision above this one, the oldest `limit`.
  virtual Result<std::vector<StoredResult>> results_after(std::int64_t revision, int limit) = 0;
  virtual Result<HistoryPosition> newest() = 0;
};

}  // namespace imprint
