#pragma once

#include <string_view>

#include <spdlog/spdlog.h>

#include "lib/result/result.h"

namespace imprint {

/// Sends the log of this process to stderr (and so to the journal): "<time> <level> <name>: <message>".
/// `level`: trace, debug, info, warning, error, off.
Result<void> open_log(std::string_view name, std::string_view level);

}  // namespace imprint
