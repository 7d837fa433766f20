#pragma once

#include <cstdint>
#include <vector>

#include "lib/targets/target_library.h"

namespace imprint {

/// Codes of 8 to 20 bits are handled: below, a ring says too little; above, its bits are too small to be read.
inline constexpr int min_code_bits = 8;
inline constexpr int max_code_bits = 20;

/// Bit `index` along the ring, clockwise from the code's first, its highest: 1 is white. The ring is closed, `index`
/// may be any.
inline int bit_at(std::uint32_t code, int bits, int index) {
  return static_cast<int>((code >> (bits - 1 - (index % bits + bits) % bits)) & 1U);
}

/// The code of `bits` bits turned by `steps` >= 0: its first `steps` bits move to its end.
std::uint32_t rotated(std::uint32_t code, int bits, int steps);

/// The smallest of a code's rotations: equal for two codes exactly when they are the same ring.
std::uint32_t smallest_rotation(std::uint32_t code, int bits);

/// Rotation-invariant Hamming distance of two codes, [A] equation 3.
int cyclic_distance(std::uint32_t a, std::uint32_t b, int bits);

/// Changes between black and white along the closed ring, t of [A] equation 6.
int bit_transitions(std::uint32_t code, int bits);

/// The smallest distance between two codes of a set; `bits` for fewer than two codes.
int smallest_distance(const std::vector<TargetCode>& codes, int bits);

}  // namespace imprint
