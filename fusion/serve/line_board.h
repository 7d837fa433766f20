#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "fusion/receive/observation_assembler.h"
#include "fusion/serve/alarm_list.h"
#include "fusion/serve/health_alarms.h"
#include "fusion/store/session_store.h"
#include "lib/imprint/imprint.h"
#include "lib/wire/wire.h"

namespace imprint {

/// `imprint.session_result/1`: a stored result with its measurement (`imprint.result/1`, or null) in `result`.
nlohmann::json to_json(const StoredResult& result);
nlohmann::json to_json(const SessionSummary& summary);

/// The session being measured.
struct CurrentSession {
  std::string session;
  std::uint32_t expected = 0;
  bool complete = false;
  std::vector<ObservationState> observations;
};

/// The copy of the line's history in another database.
struct HistoryState {
  bool connected = false;
  std::int64_t waiting_messages = 0;  ///< triggers and imprints that are only here
  std::int64_t waiting_results = 0;   ///< at most so many results
};

/// What is known of the line at this moment, for whoever asks: the page, `imprint status`. Safe to use from several
/// threads; knows the clock only for when an alarm began.
class LineBoard {
 public:
  using Time = std::chrono::steady_clock::time_point;

  struct Identity {
    std::string site;
    std::string line;
    std::string method;
    std::string version;
  };

  LineBoard(Identity identity, const std::vector<std::string>& camera_ids, Time started, HealthLimits limits = {});

  void set_alive(const std::string& camera_id, bool alive);
  /// Two nodes that send under one camera's name make the alarm `two_nodes_<camera>`: a boot id that comes back after
  /// another one was heard is no restart. It ends when only one has been heard for two minutes. Gives the text of the
  /// alarm when this record has raised it, else nothing. The alarm `exposure_<camera>` is the one of its last record.
  std::optional<std::string> set_health(const Health& health, Time now);
  void note_imprint(const Imprint& imprint, Time now);
  /// What a camera's node holds that fusion has not confirmed.
  void set_delivery(const Delivery& delivery, Time now);
  /// The node's clock against this machine's.
  void set_clock(const std::string& camera_id, ClockOffset offset);
  /// What fusion misses between the imprints of a camera that it has: how many, and which sequence numbers.
  void set_missing(const std::string& camera_id, std::uint64_t count, const std::string& numbers);
  void set_session(CurrentSession session);
  void set_history(HistoryState history);
  void set_result(const StoredResult& result);
  /// Adds to one of the counters of the status document.
  void count(const std::string& counter, std::uint64_t by = 1);
  /// A condition that needs a person; an empty text ends it.
  void set_alarm(const std::string& name, const std::string& text);
  /// False when there is no such alarm that nobody has acknowledged yet.
  bool acknowledge(const std::string& name, const std::string& who);

  /// `imprint.status/1` (docs/configuration.md).
  [[nodiscard]] nlohmann::json status(Time now) const;
  [[nodiscard]] bool has_alarm() const;

 private:
  struct Camera {
    bool alive = false;
    std::optional<Health> health;
    Time health_at;
    std::map<std::uint64_t, std::int64_t> boots;  // boot ids heard, each with the node's time of its newest record
    std::optional<Time> shared_at;                // when two nodes were last seen to take turns
    std::optional<Imprint> imprint;               // without its curves
    Time imprint_at;
    std::optional<Delivery> delivery;
    Time delivery_at;
    std::optional<ClockOffset> clock;
    std::uint64_t missing = 0;
    std::string missing_numbers;
  };
  std::optional<std::string> watch_for_namesakes(Camera& camera, const Health& health, Time now);
  [[nodiscard]] static nlohmann::json camera_json(const std::string& id, const Camera& camera, Time now);

  mutable std::mutex mutex_;
  Identity identity_;
  Time started_;
  std::vector<std::string> camera_ids_;
  std::map<std::string, Camera> cameras_;
  std::optional<CurrentSession> session_;
  nlohmann::json last_result_;
  std::optional<HistoryState> history_;
  std::map<std::string, std::uint64_t> counters_;
  AlarmList alarms_;
  HealthAlarms health_alarms_;
};

}  // namespace imprint
