#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "lib/result/result.h"
#include "node/segment/segment.h"

namespace imprint {

/// When a node asks for an observation by itself; `[rest]` of node.toml. All ours.
struct RestConfig {
  bool trigger = false;
  double period_ms = 500.0;    // between two looks, besides what a look takes
  double max_motion_px = 2.0;  // of the edges since the forging began to stand; a rough rim jumps by less than 1 px
  double hold_s = 1.5;         // for which it must stand
  double rearm_px = 12.0;      // once its edges have moved so far it can come to rest again

  [[nodiscard]] Result<void> validate() const;
};

/// How far the forging's edges have moved across themselves, and its ends along it, from one look to the next, in px of
/// the observed image: of the rims the 90th percentile, so that one end that swings counts as well. Nothing where the
/// two have no rim in common. A round forging that turns about its own axis moves by its unroundness and bow alone.
std::optional<double> edge_motion_px(const Segmentation& before, const Segmentation& now);

/// Says when a forging comes to rest: its edges have stood within `max_motion_px` for `hold_s`. What lies there from
/// the first look has not come to rest; nor has what rested before and has neither moved by `rearm_px` since nor been
/// out of sight for `hold_s`.
class RestWatch {
 public:
  using Time = std::chrono::steady_clock::time_point;
  explicit RestWatch(const RestConfig& config) : config_(config) {}

  /// Takes a look at the time `now` (nothing: no forging was seen). True once for each time it comes to rest.
  bool note(const std::optional<Segmentation>& seen, Time now);

 private:
  struct Place {
    Segmentation forging;
    Time since;
  };
  void miss(Time now);
  [[nodiscard]] std::chrono::duration<double> hold() const { return std::chrono::duration<double>(config_.hold_s); }

  RestConfig config_;
  std::optional<Place> standing_;        // where it stands, and since when
  std::optional<Segmentation> rested_;   // where it last came to rest, or was first seen
  std::optional<Time> missing_since_{};  // out of sight
  bool looked_ = false;
  bool armed_ = false;
};

}  // namespace imprint
