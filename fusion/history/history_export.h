#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "fusion/history/history_copy.h"
#include "fusion/serve/line_board.h"
#include "fusion/store/session_store.h"

namespace imprint {

/// Keeps a copy of the line's history up to date in a thread of its own, which nobody waits for. The store stays where
/// an imprint is safe; how far the copy has come, the copy itself says, so that neither an outage nor a copy put back
/// to an older state leaves a gap. A copy out of reach is the alarm `history`, and is tried again for ever.
class HistoryExport {
 public:
  struct Waits {
    std::chrono::milliseconds idle{1000};   // between two looks at the store
    std::chrono::milliseconds retry{2000};  // after a failure
  };

  HistoryExport(std::unique_ptr<HistoryCopy> copy, std::string site, std::string line, SessionStore& store,
                LineBoard& board, Waits waits);
  HistoryExport(std::unique_ptr<HistoryCopy> copy, std::string site, std::string line, SessionStore& store,
                LineBoard& board)
      : HistoryExport(std::move(copy), std::move(site), std::move(line), store, board, Waits{}) {}
  HistoryExport(const HistoryExport&) = delete;
  HistoryExport& operator=(const HistoryExport&) = delete;
  ~HistoryExport();

 private:
  void work();
  /// One batch; true when there may be more.
  Result<bool> turn();
  Result<HistoryPosition> connect();
  /// Whether the store is still the one that wrote what the copy has, and not an older state of it.
  Result<bool> agrees(const HistoryEnd& end);
  void show(bool connected);
  bool wait(std::chrono::milliseconds time);

  std::unique_ptr<HistoryCopy> copy_;
  std::string site_;
  std::string line_;
  SessionStore& store_;
  LineBoard& board_;
  Waits waits_;
  std::optional<HistoryPosition> position_;  // none: not connected
  HistoryPosition reached_;                  // the last known
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace imprint
