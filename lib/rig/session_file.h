#pragma once

#include "lib/rig/rig.h"

namespace imprint {

/// As `read_session_file(path)`; what the file says and nobody understands, such as a mistyped key, goes to `warnings`.
Result<SessionFile> read_session_file(const std::filesystem::path& path, std::vector<std::string>& warnings);

}  // namespace imprint
