#include "lib/targets/library_generator.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <map>
#include <optional>
#include <random>

#include "lib/targets/code_distance.h"
#include "lib/targets/independent_set.h"

namespace imprint {
namespace {

/// Above this many candidates the graph would not fit the time: 18 bits and more are searched in a random part.
constexpr std::size_t max_candidates = 4000;

/// Moves of one search are bounded by the entries of neighbour lists it walks through, which is what takes the time.
constexpr std::int64_t max_list_entries = 100'000'000;
constexpr std::int64_t max_steps = 1'500'000;

enum class Weight { any, even };

/// Codes to choose from, and the distance of each to those before it.
struct Candidates {
  std::vector<std::uint32_t> codes;
  std::vector<std::uint8_t> distances;  ///< row i, from i (i - 1) / 2, has those to 0 .. i - 1
};

/// As std::popcount, written out: the base line of the processor has no instruction for it, and this is done for four
/// words at once.
constexpr std::uint32_t count_ones(std::uint32_t word) {
  word -= (word >> 1U) & 0x55555555U;
  word = (word & 0x33333333U) + ((word >> 2U) & 0x33333333U);
  word = (word + (word >> 4U)) & 0x0f0f0f0fU;
  return (word * 0x01010101U) >> 24U;
}

std::vector<std::uint8_t> distances_among(const std::vector<std::uint32_t>& codes, int bits) {
  std::vector<std::uint8_t> distances;
  distances.reserve(codes.size() * (codes.size() - 1) / 2);
  std::array<std::uint32_t, max_code_bits> turned{};
  for (std::size_t i = 0; i < codes.size(); ++i) {
    // All places of the array hold a rotation: a loop of fixed length is what the compiler makes fast.
    for (int k = 0; k < max_code_bits; ++k) turned[static_cast<std::size_t>(k)] = rotated(codes[i], bits, k % bits);
    for (std::size_t j = 0; j < i; ++j) {
      std::uint32_t smallest = max_code_bits;
      for (const std::uint32_t rotation : turned) smallest = std::min(smallest, count_ones(rotation ^ codes[j]));
      distances.push_back(static_cast<std::uint8_t>(smallest));
    }
  }
  return distances;
}

class CodeSearch {
 public:
  CodeSearch(int bits, int count) : bits_(bits), count_(static_cast<std::size_t>(count)), full_(full_library(bits)) {}

  /// A set with at least this distance and these transitions, if the search finds one.
  std::optional<std::vector<std::uint32_t>> find(int distance, int transitions) {
    // Codes of even weight are an even number of bits apart: among them an odd distance comes with one more.
    for (const Weight weight : {Weight::even, Weight::any}) {
      const Candidates& candidates = candidates_for(transitions, weight);
      if (candidates.codes.size() < count_) continue;
      const NeighbourLists graph = graph_of(candidates, distance);
      const auto set = find_independent_set(graph, count_, steps_for(graph));
      if (set.size() < count_) continue;
      std::vector<std::uint32_t> codes;
      for (const std::int32_t v : set) codes.push_back(candidates.codes[static_cast<std::size_t>(v)]);
      return codes;
    }
    return std::nullopt;
  }

  [[nodiscard]] int bits() const { return bits_; }

 private:
  /// Searches for one number of transitions follow each other: the candidates of the last are kept.
  const Candidates& candidates_for(int transitions, Weight weight) {
    if (transitions != kept_transitions_) kept_.clear();
    kept_transitions_ = transitions;
    if (const auto known = kept_.find(weight); known != kept_.end()) return known->second;
    Candidates candidates{choose_candidates(transitions, weight), {}};
    if (candidates.codes.size() >= count_) candidates.distances = distances_among(candidates.codes, bits_);
    return kept_.emplace(weight, std::move(candidates)).first->second;
  }

  [[nodiscard]] std::vector<std::uint32_t> choose_candidates(int transitions, Weight weight) const {
    std::vector<std::uint32_t> candidates;
    for (const std::uint32_t code : full_) {
      if (weight == Weight::even && std::popcount(code) % 2 != 0) continue;
      if (bit_transitions(code, bits_) >= transitions) candidates.push_back(code);
    }
    if (candidates.size() > max_candidates) {
      std::mt19937_64 random(bits_);
      for (std::size_t i = 0; i < max_candidates; ++i) {
        std::swap(candidates[i], candidates[i + random() % (candidates.size() - i)]);
      }
      candidates.resize(std::max(max_candidates, count_));
    }
    return candidates;
  }

  static NeighbourLists graph_of(const Candidates& candidates, int distance) {
    NeighbourLists graph(candidates.codes.size());
    auto apart = candidates.distances.begin();
    for (std::size_t i = 0; i < graph.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j, ++apart) {
        if (*apart >= distance) continue;
        graph[i].push_back(static_cast<std::int32_t>(j));
        graph[j].push_back(static_cast<std::int32_t>(i));
      }
    }
    return graph;
  }

  static std::int64_t steps_for(const NeighbourLists& graph) {
    std::int64_t entries = 1;
    for (const auto& neighbours : graph) entries += static_cast<std::int64_t>(neighbours.size());
    const std::int64_t mean = 1 + entries / static_cast<std::int64_t>(graph.size());
    return std::min(max_steps, max_list_entries / mean);
  }

  int bits_;
  std::size_t count_;
  std::vector<std::uint32_t> full_;
  int kept_transitions_ = -1;
  std::map<Weight, Candidates> kept_;
};

/// Raises the convenience number, then the distance, then the transitions, each until the search fails.
std::optional<std::vector<std::uint32_t>> find_best(CodeSearch& search) {
  auto best = search.find(1, 0);
  if (!best) return std::nullopt;
  int convenience = 0;
  const auto better = [&](int distance, int transitions) {
    auto found = search.find(distance, transitions);
    if (found) best = std::move(found);
    return found.has_value();
  };
  while (convenience < search.bits() && better(convenience + 1, 2 * (convenience + 1))) ++convenience;
  int transitions = 2 * convenience;
  int distance = std::max(1, convenience);
  while (distance < search.bits() && better(distance + 1, transitions)) ++distance;
  while (transitions < search.bits() && better(distance, transitions + 2)) transitions += 2;
  return best;
}

}  // namespace

std::vector<std::uint32_t> full_library(int bits) {
  std::vector<std::uint32_t> codes;
  for (std::uint32_t code = 0; code < (std::uint32_t{1} << bits); ++code) {
    if (smallest_rotation(code, bits) == code) codes.push_back(code);
  }
  return codes;
}

Result<GeneratedLibrary> generate_library(int bits, int count) {
  if (bits < min_code_bits || bits > max_code_bits) {
    return invalid_input("--bits {}: expected {} to {}", bits, min_code_bits, max_code_bits);
  }
  if (count < 1) return invalid_input("--count {}: expected at least 1", count);
  CodeSearch search(bits, count);
  const auto codes = find_best(search);
  if (!codes) {
    return invalid_input("--count {}: expected at most {}, the number of different rings of {} bits", count,
                         full_library(bits).size(), bits);
  }
  GeneratedLibrary generated;
  generated.library.bits = bits;
  generated.least_transitions = std::numeric_limits<int>::max();
  std::vector<std::uint32_t> sorted = *codes;
  std::sort(sorted.begin(), sorted.end());
  std::stable_sort(sorted.begin(), sorted.end(), [bits](std::uint32_t a, std::uint32_t b) {
    return bit_transitions(a, bits) > bit_transitions(b, bits);
  });
  for (const std::uint32_t code : sorted) {
    generated.library.codes.push_back({static_cast<int>(generated.library.codes.size()) + 1, code});
    generated.least_transitions = std::min(generated.least_transitions, bit_transitions(code, bits));
  }
  generated.library.min_distance = smallest_distance(generated.library.codes, bits);
  return generated;
}

}  // namespace imprint
