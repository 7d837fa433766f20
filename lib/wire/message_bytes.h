#pragma once

#include <algorithm>
#include <climits>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

/// Zero for what is no number: a receiver refuses a message with NaN or infinity as a whole.
inline double finite_or_zero(double value) { return std::isfinite(value) ? value : 0.0; }
inline float wire_float(double value) {
  const auto narrowed = static_cast<float>(value);
  return std::isfinite(narrowed) ? narrowed : 0.0F;
}
inline std::uint32_t wire_count(int count) { return static_cast<std::uint32_t>(std::max(count, 0)); }
inline int read_count(std::uint32_t count) { return static_cast<int>(std::min<std::uint32_t>(count, INT_MAX)); }

/// The bytes of a protobuf message.
template <class Message>
std::vector<std::uint8_t> bytes_of(const Message& message) {
  std::vector<std::uint8_t> bytes(message.ByteSizeLong());
  message.SerializeWithCachedSizesToArray(bytes.data());
  return bytes;
}

/// Keeps protobuf from writing to stderr about bytes that are refused anyhow, with a reason.
void silence_protobuf();

/// The message in `bytes`; refuses more than `max_bytes`, what is no protobuf, and what carries no schema version.
template <class Message>
Result<Message> parse_message(std::span<const std::uint8_t> bytes, std::size_t max_bytes) {
  if (bytes.size() > max_bytes) return invalid_input("expected at most {} bytes, found {}", max_bytes, bytes.size());
  silence_protobuf();
  Message message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return invalid_input("expected a protobuf message, found {} bytes that are none", bytes.size());
  if (message.schema_version() == 0) return invalid_input("expected schema_version 1 or more, found none");
  return message;
}

}  // namespace imprint
