#pragma once

#include <cstdint>
#include <string>

namespace imprint {

/// The wall clock, in ns since 1970 (UTC). Read at the pipelines, never in a stage.
std::int64_t wall_clock_ns();

/// A wall-clock time as "2025-12-31T23:59:59.999Z".
std::string utc_text(std::int64_t time_ns);

}  // namespace imprint
