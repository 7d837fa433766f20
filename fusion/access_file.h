#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "lib/access/access_list.h"
#include "lib/result/result.h"
#include "lib/transport/transport.h"

namespace imprint {

/// The access list a router obeys, and whether its file has become another one. Without a path: no rules.
class AccessFile {
 public:
  explicit AccessFile(std::filesystem::path path) : path_(std::move(path)) {}

  /// Reads the file. Fails (invalid_input) naming it, also when nobody would be let in.
  Result<std::vector<AccessRule>> rules();
  /// As last read.
  [[nodiscard]] const AccessList& list() const { return list_; }
  /// Whether the file is another one than was read, and can be: an unreadable one changes nothing and is logged once.
  bool changed();

 private:
  using Stamp = std::optional<std::filesystem::file_time_type>;
  [[nodiscard]] Stamp stamp() const;

  std::filesystem::path path_;
  AccessList list_;
  Stamp read_;
  Stamp refused_;
};

}  // namespace imprint
