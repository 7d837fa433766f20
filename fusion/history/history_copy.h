#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fusion/store/session_store.h"
#include "lib/result/result.h"

namespace imprint {

/// The database a history is of.
struct HistorySource {
  std::string store;  ///< SessionStore::identity()
  std::string site;
  std::string line;
};

/// What a copy has of one source.
struct HistoryEnd {
  HistoryPosition position;
  std::int64_t received_ns = 0;  ///< of the newest message
};

/// A database elsewhere that histories are copied to. One thread at a time.
class HistoryCopy {
 public:
  virtual ~HistoryCopy() = default;
  /// Connects anew and tells how far the copy of this source reaches. Fails (job_failed) with the database's own words.
  virtual Result<HistoryEnd> connect(const HistorySource& source) = 0;
  /// Adds to the source of the last `connect`, all or nothing; what is there already stays as it is, an older result of
  /// the same session is replaced. With nothing to add: whether it is still there.
  virtual Result<void> add(const std::vector<StoredMessage>& messages, const std::vector<StoredResult>& results) = 0;
};

/// Whether this is a connection string or URI of PostgreSQL's, without a password. Connects to nothing.
Result<void> check_postgres(const std::string& where);

/// A copy in PostgreSQL, tables in its schema `imprint`; `where` as checked.
std::unique_ptr<HistoryCopy> postgres_copy(const std::string& where);

}  // namespace imprint
