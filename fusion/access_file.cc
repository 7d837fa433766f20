#include "fusion/access_file.h"

#include "lib/log/log.h"

namespace imprint {

AccessFile::Stamp AccessFile::stamp() const {
  std::error_code failed;
  const auto time = std::filesystem::last_write_time(path_, failed);
  return failed ? Stamp() : Stamp(time);
}

Result<std::vector<AccessRule>> AccessFile::rules() {
  if (path_.empty()) return std::vector<AccessRule>{};
  const Stamp before = stamp();  // written while it is read: read again
  auto list = read_access_list(path_);
  if (!list) return pass_on(list.error());
  auto rules = access_rules(*list);
  if (!rules) return invalid_input("{}: {}", path_.string(), rules.error().message);
  if (rules->empty())
    return invalid_input("{}: holds no valid certificate: nobody could connect; see `imprint certs issue`",
                         path_.string());
  list_ = std::move(*list);
  read_ = before;
  return rules;
}

bool AccessFile::changed() {
  const Stamp now = path_.empty() ? Stamp() : stamp();
  if (now == read_ || now == refused_) return false;
  const auto list = read_access_list(path_);
  const bool usable = list && access_rules(*list).value_or(std::vector<AccessRule>{}).size() > 0;
  if (usable) return true;
  refused_ = now;
  spdlog::error("{}: not usable, what was read before stays in force: {}", path_.string(),
                list ? "it holds no valid certificate" : list.error().message);
  return false;
}

}  // namespace imprint
