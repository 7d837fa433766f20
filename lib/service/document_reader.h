#pragma once

#include <chrono>
#include <span>
#include <string>

#include "lib/transport/transport.h"

namespace imprint {

/// The whole document that a DocumentDesk has for the key and parameters ("lines=50"), fetched piece by piece; a piece
/// that does not come is asked for again. Fails (job_failed) with the desk's own words, or when it is not all there
/// within the timeout.
Result<Bytes> read_document(Transport& transport, const std::string& key, const std::string& parameters,
                            std::span<const std::uint8_t> payload, std::chrono::milliseconds timeout);

}  // namespace imprint
