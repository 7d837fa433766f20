#include "simulation/code_set.h"

#include <algorithm>
#include <bit>

namespace imprint {
namespace {

constexpr int bits = 15;
constexpr std::uint32_t mask = (1U << bits) - 1U;
constexpr int least_distance = 3;
constexpr int least_transitions = 6;
constexpr std::size_t count = 60;

std::uint32_t rotated(std::uint32_t code, int by) { return ((code << by) | (code >> (bits - by))) & mask; }

int distance(std::uint32_t a, std::uint32_t b) {  // [A] equation 3
  int smallest = bits;
  for (int k = 0; k < bits; ++k) smallest = std::min(smallest, std::popcount(rotated(a, k) ^ b));
  return smallest;
}

}  // namespace

TargetLibrary scene_library() {
  TargetLibrary library;
  library.bits = bits;
  library.min_distance = bits;
  for (std::uint32_t code = 1; code < mask && library.codes.size() < count; ++code) {
    if (std::popcount(code ^ rotated(code, 1)) < least_transitions) continue;
    int nearest = bits;
    for (const TargetCode& other : library.codes) nearest = std::min(nearest, distance(code, other.code));
    if (nearest < least_distance) continue;
    library.min_distance = std::min(library.min_distance, nearest);
    library.codes.push_back({static_cast<int>(library.codes.size()) + 1, code});
  }
  return library;
}

}  // namespace imprint
