#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "fusion/serve/line_board.h"
#include "fusion/store/session_store.h"
#include "lib/transport/transport.h"
#include "lib/wire/keys.h"

namespace imprint {

/// Makes a stored result known: on the line, on the board and, where wanted, as a file. One thread at a time.
class ResultAnnouncer {
 public:
  /// `result_dir` empty: no files.
  ResultAnnouncer(Transport& transport, Keys keys, std::filesystem::path result_dir, LineBoard& board)
      : transport_(transport), keys_(std::move(keys)), result_dir_(std::move(result_dir)), board_(board) {}

  void announce(const StoredResult& result);
  /// `<result_dir>/<session>/result.json`, if it is not there as it is; a file that cannot be written raises an alarm.
  void write_file(const StoredResult& result);

 private:
  void publish(const StoredResult& result);

  Transport& transport_;
  Keys keys_;
  std::filesystem::path result_dir_;
  LineBoard& board_;
  std::map<std::string, std::unique_ptr<Publisher>> publishers_;
  std::deque<std::string> published_sessions_;  // the oldest first
};

}  // namespace imprint
