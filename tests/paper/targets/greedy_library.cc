#include "tests/paper/targets/greedy_library.h"

#include <algorithm>
#include <bit>
#include <vector>

namespace imprint::paper {
namespace {

std::uint32_t turned(std::uint32_t code, int bits) { return (code >> 1U) | ((code & 1U) << (bits - 1)); }

int distance(std::uint32_t a, std::uint32_t b, int bits) {  // [A] equation 3
  int least = bits;
  for (int k = 0; k < bits; ++k, a = turned(a, bits)) least = std::min(least, std::popcount(a ^ b));
  return least;
}

}  // namespace

TargetLibrary greedy_library(int bits, int count) {
  std::vector<std::uint32_t> rings;
  std::vector<double> convenience;
  for (std::uint32_t code = 0; code < (1U << bits); ++code) {
    const bool is_new = std::none_of(rings.begin(), rings.end(), [&](std::uint32_t known) {
      return std::popcount(known) == std::popcount(code) && distance(code, known, bits) == 0;
    });
    if (!is_new) continue;
    rings.push_back(code);
    convenience.push_back(0.5 * std::popcount(code ^ turned(code, bits)));  // transitions / 2
  }
  TargetLibrary library;
  library.bits = bits;
  library.min_distance = bits;
  std::vector<bool> taken(rings.size(), false);
  for (int id = 1; id <= count; ++id) {
    std::size_t best = rings.size();
    for (std::size_t i = 0; i < rings.size(); ++i) {
      if (!taken[i] && (best == rings.size() || convenience[i] > convenience[best])) best = i;
    }
    taken[best] = true;
    for (const TargetCode& known : library.codes) {
      library.min_distance = std::min(library.min_distance, distance(rings[best], known.code, bits));
    }
    library.codes.push_back({id, rings[best]});
    for (std::size_t i = 0; i < rings.size(); ++i) {
      convenience[i] = std::min(convenience[i], static_cast<double>(distance(rings[i], rings[best], bits)));
    }
  }
  return library;
}

}  // namespace imprint::paper
