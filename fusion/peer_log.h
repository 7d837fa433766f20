#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>

#include "fusion/serve/line_board.h"
#include "lib/access/access_list.h"
#include "lib/transport/transport.h"

namespace imprint {

/// Logs who comes, goes and is refused, by the name of its certificate, and counts what was refused. The same refusal
/// is logged once a minute: a flood must not fill the journal.
class PeerLog {
 public:
  /// `own_name`: what this program calls itself to others, see certificate_name().
  PeerLog(AccessList list, LineBoard& board, std::string own_name)
      : list_(std::move(list)), board_(board), own_name_(std::move(own_name)) {}

  void note(const PeerNotice& notice);

 private:
  void refused(const std::string& what);
  bool is_new(const std::string& what);  ///< it was not logged within the last minute

  AccessList list_;
  LineBoard& board_;
  std::string own_name_;
  std::mutex mutex_;
  std::map<std::string, std::chrono::steady_clock::time_point> logged_;
};

}  // namespace imprint
