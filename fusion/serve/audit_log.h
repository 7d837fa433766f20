#pragma once

#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "lib/result/result.h"

namespace imprint {

/// Who changed what, one JSON line each, only ever added to: `{"time", "who", "from", "what", "detail"}`. A line is on
/// the disk when note() returns. Safe to use from several threads.
class AuditLog {
 public:
  /// `path` empty: nothing is kept.
  explicit AuditLog(std::filesystem::path path) : path_(std::move(path)) {}

  /// Fails (job_failed) when it cannot be written: what it was to tell must then not be done.
  Result<void> note(const std::string& who, const std::string& from, const std::string& what, nlohmann::json detail);
  /// The newest `limit` lines, newest first.
  Result<nlohmann::json> newest(std::size_t limit) const;

 private:
  std::filesystem::path path_;
  mutable std::mutex mutex_;
};

}  // namespace imprint
