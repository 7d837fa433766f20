#pragma once

#include <filesystem>
#include <string_view>

#include "lib/result/result.h"

namespace imprint {

/// One program's claim to what a lock file stands for, held as long as this lives; the system ends it with the process,
/// however that ends.
class FileLock {
 public:
  /// Takes `path`, made when it is not there. Fails (invalid_input) when it cannot be made, or when another program
  /// holds it: `if_held` is then the message.
  static Result<FileLock> take(const std::filesystem::path& path, std::string_view if_held);

  FileLock(FileLock&& other) noexcept;
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

 private:
  explicit FileLock(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace imprint
