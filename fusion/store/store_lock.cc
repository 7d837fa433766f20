#include "fusion/store/store_lock.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace imprint {

Result<StoreLock> StoreLock::take(const std::filesystem::path& database) {
  const std::string path = database.string() + ".lock";
  StoreLock lock(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (lock.fd_ < 0) {
    return invalid_input("{}: cannot be opened: {}; check that the folder exists and is writable", path,
                         std::strerror(errno));
  }
  if (::flock(lock.fd_, LOCK_EX | LOCK_NB) != 0) {
    return invalid_input(
        "{}: in use by another imprint-fusion (it holds {}); stop that one, or name another file as fusion.database",
        database.string(), path);
  }
  return lock;
}

StoreLock::StoreLock(StoreLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

StoreLock::~StoreLock() {
  if (fd_ >= 0) ::close(fd_);
}

}  // namespace imprint
