#pragma once

#include <cstdint>
#include <vector>

namespace imprint {

/// An undirected graph as lists of neighbours, vertices 0 to n - 1.
using NeighbourLists = std::vector<std::vector<std::int32_t>>;

/// `size` vertices of which no two are neighbours, or fewer where the search, which takes `steps` moves, found no such
/// set: a tabu search that adds free vertices, swaps one for one where none is free, and else forces in the vertex
/// that displaces fewest. Deterministic.
std::vector<std::int32_t> find_independent_set(const NeighbourLists& graph, std::size_t size, std::int64_t steps);

}  // namespace imprint
