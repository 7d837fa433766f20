// In place of postgres_copy.cc where libpq is not there.
#include "fusion/history/history_copy.h"

namespace imprint {

Result<void> check_postgres(const std::string& where) {
  return invalid_input("{}: this imprint-fusion was built without PostgreSQL (Meson's option postgresql)", where);
}

std::unique_ptr<HistoryCopy> postgres_copy(const std::string&) { return nullptr; }

}  // namespace imprint
