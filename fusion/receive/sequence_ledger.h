#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace imprint {

/// Where an imprint stands among those of its node and start.
enum class Place {
  next,      ///< the one after the highest so far, or the first heard of this start
  ahead,     ///< further on: the ones between are missing now
  belated,   ///< one that was missing
  repeated,  ///< already there
};

/// Which imprints of one camera are there, by start of the node (boot id) and sequence number: the order they came in
/// and the gaps between them. Counts from the first number it has heard of, for an earlier one may be in another
/// database; remembers the last starts.
class SequenceLedger {
 public:
  using Range = std::pair<std::uint64_t, std::uint64_t>;  ///< first and last, both included

  Place add(std::uint64_t boot_id, std::uint64_t sequence);
  /// What the node says of itself: it has made imprints up to `last`, and still holds those from `oldest_waiting` on
  /// (0: none). Nothing is there by that, but it is known to be missing.
  void announce(std::uint64_t boot_id, std::uint64_t last, std::uint64_t oldest_waiting);

  struct Gap {
    std::uint64_t boot_id = 0;
    Range missing;
  };
  /// The missing ones, at most 16 stretches of each start, by start as they were first heard of.
  [[nodiscard]] std::vector<Gap> gaps() const;
  /// How many imprints are missing altogether.
  [[nodiscard]] std::uint64_t missing() const;

 private:
  struct Start {
    std::uint64_t boot_id = 0;
    std::uint64_t first = 0;                          // 0: nothing heard
    std::uint64_t last = 0;                           // made by the node, as far as known
    std::map<std::uint64_t, std::uint64_t> received;  // stretches: first -> last, apart from each other
  };
  Start& start_of(std::uint64_t boot_id);
  [[nodiscard]] static std::vector<Range> missing_of(const Start& start);

  std::vector<Start> starts_;  // the oldest first
};

/// "3-5, 9".
std::string ranges_text(const std::vector<SequenceLedger::Range>& ranges);

}  // namespace imprint
