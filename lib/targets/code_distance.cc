#include "lib/targets/code_distance.h"

#include <algorithm>
#include <bit>

namespace imprint {

std::uint32_t rotated(std::uint32_t code, int bits, int steps) {
  const std::uint32_t mask = (std::uint32_t{1} << bits) - 1;
  const int shift = steps % bits;
  return ((code << shift) | (code >> (bits - shift))) & mask;
}

std::uint32_t smallest_rotation(std::uint32_t code, int bits) {
  std::uint32_t smallest = code;
  for (int k = 1; k < bits; ++k) smallest = std::min(smallest, rotated(code, bits, k));
  return smallest;
}

int cyclic_distance(std::uint32_t a, std::uint32_t b, int bits) {
  int smallest = bits;
  for (int k = 0; k < bits; ++k) smallest = std::min(smallest, std::popcount(rotated(a, bits, k) ^ b));
  return smallest;
}

int bit_transitions(std::uint32_t code, int bits) { return std::popcount(code ^ rotated(code, bits, 1)); }

int smallest_distance(const std::vector<TargetCode>& codes, int bits) {
  int smallest = bits;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j)
      smallest = std::min(smallest, cyclic_distance(codes[i].code, codes[j].code, bits));
  }
  return smallest;
}

}  // namespace imprint
