#pragma once

#include <string_view>

#include "lib/result/result.h"

namespace imprint {

/// Checks a key (`wildcards` false) or a key expression as Zenoh writes them: chunks divided by '/', none
/// empty; `*` stands for one chunk, `**` for any number; no `#`, `?` or `$`. Fails (invalid_input) naming it.
Result<void> check_key(std::string_view key, bool wildcards);

/// Whether some key matches both expressions. Wildcards do not match a chunk that begins with '@'.
bool keys_intersect(std::string_view a, std::string_view b);

}  // namespace imprint
