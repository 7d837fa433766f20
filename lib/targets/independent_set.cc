#include "lib/targets/independent_set.h"

#include <algorithm>
#include <random>

namespace imprint {
namespace {

/// Vertices grouped by how many members of the set they touch (0, 1, 2 or more), each group an array that a random
/// pick and a move between groups take constant time in.
class TabuSearch {
 public:
  explicit TabuSearch(const NeighbourLists& graph)
      : graph_(graph),
        touches_(graph.size(), 0),
        in_set_(graph.size(), false),
        tabu_until_(graph.size(), 0),
        place_(graph.size()) {
    for (std::size_t v = 0; v < graph.size(); ++v) enter_group(static_cast<std::int32_t>(v));
  }

  std::vector<std::int32_t> run(std::size_t size, std::int64_t steps) {
    std::vector<std::int32_t> best;
    for (step_ = 0; step_ < steps && best.size() < size; ++step_) {
      const std::int32_t next = choose();
      if (next >= 0) force_in(next);
      if (set_size_ > best.size()) best = members();
    }
    return best;
  }

 private:
  static constexpr int groups = 3;

  std::int32_t choose() {
    // A move that displaces two loses a member: taken when no other is allowed, and now and then to leave a plateau.
    const bool leap = random_() % 4096 == 0;
    for (int group = leap ? groups - 1 : 0; group < groups; ++group) {
      if (const std::int32_t v = pick(group); v >= 0) return v;
    }
    return -1;
  }

  std::int32_t pick(int group) {
    const auto& vertices = group_[static_cast<std::size_t>(group)];
    if (vertices.empty()) return -1;
    constexpr int tries = 24;  // of which nearly every one succeeds: the tabu list is short
    for (int i = 0; i < tries; ++i) {
      const std::int32_t v = vertices[random_() % vertices.size()];
      if (tabu_until_[static_cast<std::size_t>(v)] <= step_) return v;
    }
    return -1;
  }

  void force_in(std::int32_t v) {
    if (touches_[static_cast<std::size_t>(v)] > 0) {
      for (const std::int32_t u : graph_[static_cast<std::size_t>(v)]) {
        if (!in_set_[static_cast<std::size_t>(u)]) continue;
        remove(u);
        tabu_until_[static_cast<std::size_t>(u)] = step_ + 7 + static_cast<std::int64_t>(random_() % 10);
      }
    }
    leave_group(v);
    in_set_[static_cast<std::size_t>(v)] = true;
    ++set_size_;
    for (const std::int32_t u : graph_[static_cast<std::size_t>(v)]) shift(u, 1);
  }

  void remove(std::int32_t v) {
    in_set_[static_cast<std::size_t>(v)] = false;
    --set_size_;
    enter_group(v);
    for (const std::int32_t u : graph_[static_cast<std::size_t>(v)]) shift(u, -1);
  }

  void shift(std::int32_t v, int change) {
    auto& touches = touches_[static_cast<std::size_t>(v)];
    const bool moves = !in_set_[static_cast<std::size_t>(v)];
    if (moves) leave_group(v);
    touches += change;
    if (moves) enter_group(v);
  }

  [[nodiscard]] int group_of(std::int32_t v) const { return touches_[static_cast<std::size_t>(v)]; }

  void enter_group(std::int32_t v) {
    if (group_of(v) >= groups) return;
    auto& group = group_[static_cast<std::size_t>(group_of(v))];
    place_[static_cast<std::size_t>(v)] = group.size();
    group.push_back(v);
  }

  void leave_group(std::int32_t v) {
    if (group_of(v) >= groups) return;
    auto& group = group_[static_cast<std::size_t>(group_of(v))];
    const std::size_t place = place_[static_cast<std::size_t>(v)];
    group[place] = group.back();
    place_[static_cast<std::size_t>(group[place])] = place;
    group.pop_back();
  }

  [[nodiscard]] std::vector<std::int32_t> members() const {
    std::vector<std::int32_t> result;
    for (std::size_t v = 0; v < in_set_.size(); ++v) {
      if (in_set_[v]) result.push_back(static_cast<std::int32_t>(v));
    }
    return result;
  }

  const NeighbourLists& graph_;
  std::vector<int> touches_;
  std::vector<bool> in_set_;
  std::vector<std::int64_t> tabu_until_;
  std::vector<std::size_t> place_;
  std::vector<std::int32_t> group_[groups];
  std::size_t set_size_ = 0;
  std::int64_t step_ = 0;
  std::mt19937_64 random_{20210115};  // any fixed seed: the result must not change from run to run
};

}  // namespace

std::vector<std::int32_t> find_independent_set(const NeighbourLists& graph, std::size_t size, std::int64_t steps) {
  return TabuSearch(graph).run(size, steps);
}

}  // namespace imprint
