#pragma once

#include <filesystem>

#include "lib/result/result.h"

namespace imprint {

/// One program's claim to a database, held as long as this lives; the system ends it with the process, however that
/// ends. Two fusion nodes on one file would each announce results without the other's imprints.
class StoreLock {
 public:
  /// Takes `<database>.lock` beside the file (SQLite itself locks the file, and loses its locks when another
  /// descriptor of it is closed). Fails (invalid_input) when another program holds it or it cannot be made.
  static Result<StoreLock> take(const std::filesystem::path& database);

  StoreLock(StoreLock&& other) noexcept;
  StoreLock(const StoreLock&) = delete;
  StoreLock& operator=(const StoreLock&) = delete;
  StoreLock& operator=(StoreLock&&) = delete;
  ~StoreLock();

 private:
  explicit StoreLock(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace imprint
