#include "lib/config/atomic_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace imprint {
namespace {

// A full or broken disk is no fault of what was asked for: the same call succeeds once there is room.
Error write_failure(const std::filesystem::path& path, int reason) {
  const bool disk = reason == ENOSPC || reason == EDQUOT || reason == EIO;
  const char* advice = reason == ENOSPC || reason == EDQUOT ? "; make room there or write elsewhere"
                       : reason == EIO                      ? "; the disk or the link to it is broken"
                       : reason == EISDIR                   ? "; name a file, not a folder"
                                                            : "; check that the folder exists and is writable";
  return {disk ? ErrorKind::job_failed : ErrorKind::invalid_input,
          fmt::format("{}: cannot be written: {}{}", path.string(), std::strerror(reason), advice)};
}

// Closes on every way out; `close` tells whether the last bytes reached the file.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  ~FileDescriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const { return fd_; }
  bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

// The new name reaches the disk with the folder that holds it. A file system that cannot do that has done its best.
void sync_folder_of(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  const FileDescriptor file(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (file.get() >= 0) (void)::fsync(file.get());
}

}  // namespace

Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view bytes) {
  std::string temporary = path.string() + ".XXXXXX";
  FileDescriptor file(::mkostemp(temporary.data(), O_CLOEXEC));
  if (file.get() < 0) {
    return pass_on(write_failure(path, errno));
  }
  const bool written = ::fchmod(file.get(), 0644) == 0 && write_all(file.get(), bytes) && ::fsync(file.get()) == 0 &&
                       file.close() && ::rename(temporary.c_str(), path.c_str()) == 0;
  if (!written) {
    const int reason = errno;
    ::unlink(temporary.c_str());
    return pass_on(write_failure(path, reason));
  }
  sync_folder_of(path);
  return {};
}

Result<std::string> read_file(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return invalid_input("{}: is a folder, expected a file", path.string());
  }
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream content;
  if (stream && stream.peek() != std::ifstream::traits_type::eof()) content << stream.rdbuf();
  if (stream.bad() || (!stream && !stream.eof())) {
    return invalid_input("{}: cannot be read: {}", path.string(), std::strerror(errno));
  }
  return std::move(content).str();
}

}  // namespace imprint
