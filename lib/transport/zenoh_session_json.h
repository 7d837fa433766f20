#pragma once

#include <string>

#include "lib/transport/transport.h"

namespace imprint {

/// How long a tool tries to reach a router.
inline constexpr int kToolTimeoutMs = 3000;

/// The session's configuration as Zenoh reads it; `config` has passed check_zenoh().
std::string zenoh_session_json(const ZenohConfig& config);

}  // namespace imprint
