#include "survey/verify_history.h"

#include <cerrno>
#include <cstring>
#include <sstream>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "lib/config/atomic_file.h"
#include "lib/config/csv_row.h"

namespace imprint {
namespace {

constexpr std::string_view kHeader =
    "time_utc,what,nominal_mm,measured_mm,deviation_mm,ci95_mm,limit_mm,cameras,result";

std::string line_of(const HistoryRow& row) {
  return fmt::format("{},{},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{},{}\n", row.time_utc, row.what, row.nominal_mm,
                     row.measured_mm, row.deviation_mm, row.ci95_mm, row.limit_mm, row.cameras,
                     row.pass ? "pass" : "fail");
}

// Open and locked against other writers until it goes.
class LockedFile {
 public:
  explicit LockedFile(const std::filesystem::path& path)
      : fd_(::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
    if (fd_ >= 0 && ::flock(fd_, LOCK_EX) != 0) close();
  }
  LockedFile(const LockedFile&) = delete;
  LockedFile& operator=(const LockedFile&) = delete;
  ~LockedFile() { close(); }

  [[nodiscard]] bool good() const { return fd_ >= 0; }
  [[nodiscard]] off_t size() const {
    struct stat state {};
    return ::fstat(fd_, &state) == 0 ? state.st_size : -1;
  }
  [[nodiscard]] std::string read(off_t from, std::size_t count) const {
    std::string bytes(count, '\0');
    const ssize_t got = ::pread(fd_, bytes.data(), count, from);
    bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return bytes;
  }
  // All or nothing: what a full disk cut off is taken back.
  [[nodiscard]] bool append(std::string_view bytes) const {
    const off_t before = size();
    const ssize_t written = before < 0 ? -1 : ::write(fd_, bytes.data(), bytes.size());
    if (written == static_cast<ssize_t>(bytes.size()) && ::fsync(fd_) == 0) return true;
    const int reason = errno;
    if (before >= 0 && ::ftruncate(fd_, before) != 0) return false;
    errno = reason != 0 ? reason : ENOSPC;
    return false;
  }

 private:
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  int fd_;
};

}  // namespace

Result<std::vector<HistoryRow>> read_history(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  std::istringstream stream(*text);
  std::string line;
  if (!std::getline(stream, line) || line != kHeader)
    return invalid_input("{}:1: expected the header {}", path.string(), kHeader);
  std::vector<HistoryRow> rows;
  for (int number = 2; std::getline(stream, line); ++number) {
    const auto cells = csv_cells(line);
    HistoryRow row;
    const bool valid = cells.size() == 9 && parse_number(cells[2], row.nominal_mm) &&
                       parse_number(cells[3], row.measured_mm) && parse_number(cells[4], row.deviation_mm) &&
                       parse_number(cells[5], row.ci95_mm) && parse_number(cells[6], row.limit_mm) &&
                       (cells[8] == "pass" || cells[8] == "fail");
    if (!valid) return invalid_input("{}:{}: expected a row of a history, found \"{}\"", path.string(), number, line);
    row.time_utc = cells[0];
    row.what = cells[1];
    row.cameras = cells[7];
    row.pass = cells[8] == "pass";
    rows.push_back(std::move(row));
  }
  return rows;
}

Result<void> append_history(const std::filesystem::path& path, const std::vector<HistoryRow>& rows) {
  const LockedFile file(path);
  if (!file.good())
    return invalid_input("{}: cannot be written: {}; check that the folder exists and is writable", path.string(),
                         std::strerror(errno));
  std::string text;
  const off_t size = file.size();
  if (size == 0) {
    text = std::string(kHeader) + "\n";
  } else if (file.read(0, kHeader.size() + 1) != std::string(kHeader) + "\n") {
    return invalid_input("{}:1: is no history of verifications: expected the header {}", path.string(), kHeader);
  } else if (file.read(size - 1, 1) != "\n") {
    return invalid_input("{}: its last line is cut off; take it out", path.string());
  }
  for (const HistoryRow& row : rows) text += line_of(row);
  if (!file.append(text)) return invalid_input("{}: cannot be written: {}", path.string(), std::strerror(errno));
  return {};
}

}  // namespace imprint
