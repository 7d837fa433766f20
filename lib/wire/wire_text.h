#pragma once

#include <string>
#include <string_view>

namespace imprint {

/// `text` as one line of valid UTF-8 of at most `max_bytes`: what is not UTF-8 becomes '?', control characters
/// become spaces, and what is too long is cut between two characters, ending in "...".
std::string wire_line(std::string_view text, std::size_t max_bytes);

/// `text` with what is not UTF-8 replaced by '?'; protobuf strings carry nothing else.
std::string valid_utf8(std::string_view text);

}  // namespace imprint
