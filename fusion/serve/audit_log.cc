#include "fusion/serve/audit_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <deque>
#include <fstream>

#include "lib/clock/wall_clock.h"
#include "lib/log/log.h"

namespace imprint {
namespace {

using nlohmann::json;

std::string text_of(const json& line) { return line.dump(-1, ' ', false, json::error_handler_t::replace); }

}  // namespace

Result<void> AuditLog::note(const std::string& who, const std::string& from, const std::string& what, json detail) {
  const std::string line = text_of({{"time", utc_text(wall_clock_ns())},
                                    {"who", who},
                                    {"from", from},
                                    {"what", what},
                                    {"detail", std::move(detail)}}) +
                           "\n";
  spdlog::info("{} ({}): {}", who, from, what);
  if (path_.empty()) return {};
  const std::lock_guard lock(mutex_);
  const int fd = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0640);
  if (fd < 0) return job_failed("{}: cannot be written: {}", path_.string(), std::strerror(errno));
  const bool written = ::write(fd, line.data(), line.size()) == static_cast<ssize_t>(line.size()) && ::fsync(fd) == 0;
  const int reason = errno;
  ::close(fd);
  if (!written) return job_failed("{}: cannot be written: {}", path_.string(), std::strerror(reason));
  return {};
}

Result<json> AuditLog::newest(std::size_t limit) const {
  const std::lock_guard lock(mutex_);
  std::deque<json> lines;
  std::ifstream file(path_);
  for (std::string text; std::getline(file, text);) {
    json line = json::parse(text, nullptr, false);
    if (line.is_discarded()) continue;  // the disk was full
    lines.push_front(std::move(line));
    if (lines.size() > limit) lines.pop_back();
  }
  return json(lines);
}

}  // namespace imprint
