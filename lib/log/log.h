#pragma once

#include <string>
#include <string_view>

#include <spdlog/spdlog.h>

#include "lib/result/result.h"

namespace imprint {

/// Sends the log of this process to stderr (and so to the journal): "<time> <level> <name>: <message>".
/// `level`: trace, debug, info, warning, error, off.
Result<void> open_log(std::string_view name, std::string_view level);

/// The last lines of this process' log, the newest last; at most 500 are remembered.
std::string recent_log(std::size_t lines);

}  // namespace imprint
