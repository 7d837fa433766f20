#include "fusion/receive/sequence_ledger.h"

#include <algorithm>

#include <fmt/core.h>

namespace imprint {
namespace {

constexpr std::size_t kMaxStarts = 8;
constexpr std::size_t kMaxGaps = 16;
constexpr std::size_t kMaxStretches = 4096;  // of one start: bounds what a sender of odd numbers can take

}  // namespace

Place SequenceLedger::add(std::uint64_t boot_id, std::uint64_t sequence) {
  Start& start = start_of(boot_id);
  const bool first_heard = start.received.empty();
  auto after = start.received.upper_bound(sequence);
  const auto before = after == start.received.begin() ? start.received.end() : std::prev(after);
  if (before != start.received.end() && sequence <= before->second) return Place::repeated;

  const std::uint64_t highest = first_heard ? 0 : start.received.rbegin()->second;
  std::uint64_t from = sequence, to = sequence;
  if (before != start.received.end() && before->second + 1 == sequence) from = before->first;
  if (after != start.received.end() && after->first == sequence + 1) to = after->second;
  if (to != sequence) start.received.erase(after);
  if (from != sequence || start.received.size() < kMaxStretches) start.received[from] = to;
  start.first = start.first == 0 ? sequence : std::min(start.first, sequence);
  start.last = std::max(start.last, sequence);
  if (first_heard || sequence == highest + 1) return Place::next;
  return sequence > highest ? Place::ahead : Place::belated;
}

void SequenceLedger::announce(std::uint64_t boot_id, std::uint64_t last, std::uint64_t oldest_waiting) {
  Start& start = start_of(boot_id);
  start.last = std::max(start.last, last);
  if (oldest_waiting > 0) start.first = start.first == 0 ? oldest_waiting : std::min(start.first, oldest_waiting);
}

std::vector<SequenceLedger::Gap> SequenceLedger::gaps() const {
  std::vector<Gap> gaps;
  for (const Start& start : starts_) {
    std::size_t count = 0;
    for (const Range& range : missing_of(start)) {
      if (++count > kMaxGaps) break;
      gaps.push_back({start.boot_id, range});
    }
  }
  return gaps;
}

std::uint64_t SequenceLedger::missing() const {
  std::uint64_t count = 0;
  for (const Start& start : starts_) {
    for (const Range& range : missing_of(start)) count += range.second - range.first + 1;
  }
  return count;
}

SequenceLedger::Start& SequenceLedger::start_of(std::uint64_t boot_id) {
  const auto known = std::ranges::find(starts_, boot_id, &Start::boot_id);
  if (known != starts_.end()) return *known;
  if (starts_.size() >= kMaxStarts) starts_.erase(starts_.begin());
  starts_.push_back({boot_id, 0, 0, {}});
  return starts_.back();
}

std::vector<SequenceLedger::Range> SequenceLedger::missing_of(const Start& start) {
  std::vector<Range> missing;
  if (start.first == 0) return missing;
  std::uint64_t expected = start.first;
  for (const auto& [from, to] : start.received) {
    if (from > expected) missing.emplace_back(expected, from - 1);
    expected = to + 1;
  }
  if (start.last >= expected) missing.emplace_back(expected, start.last);
  return missing;
}

std::string ranges_text(const std::vector<SequenceLedger::Range>& ranges) {
  std::string text;
  for (const auto& [from, to] : ranges) {
    if (!text.empty()) text += ", ";
    text += from == to ? fmt::format("{}", from) : fmt::format("{}-{}", from, to);
  }
  return text;
}

}  // namespace imprint
