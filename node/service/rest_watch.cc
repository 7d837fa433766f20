#include "node/service/rest_watch.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace imprint {
namespace {

constexpr std::size_t kStationStep = 8;  // px along the axis; neighbours say the same
constexpr std::size_t kMinPlaces = 8;
constexpr double kShare = 0.9;

struct Rims {
  float upper = 0.0F;
  float lower = 0.0F;
};

std::optional<Rims> rims_at(const Segmentation& forging, std::ptrdiff_t index) {
  if (index < 0 || index >= std::ssize(forging.upper_offset_px)) return std::nullopt;
  const Rims rims{forging.upper_offset_px[static_cast<std::size_t>(index)],
                  forging.lower_offset_px[static_cast<std::size_t>(index)]};
  return std::isnan(rims.upper) || std::isnan(rims.lower) ? std::nullopt : std::optional(rims);
}

// First and last station with both rims.
std::optional<std::pair<int, int>> extent_px(const Segmentation& forging) {
  std::optional<std::pair<int, int>> extent;
  for (std::ptrdiff_t i = 0; i < std::ssize(forging.upper_offset_px); ++i) {
    if (!rims_at(forging, i)) continue;
    const int station = forging.first_station_px + static_cast<int>(i);
    extent = std::pair(extent ? extent->first : station, station);
  }
  return extent;
}

struct StationOffset {
  double station_px = 0.0;
  double offset_px = 0.0;
};

// A point given by station and offset of one segmentation, in those of another.
StationOffset moved_to(const Segmentation& to, const Segmentation& from, double station_px, double offset_px) {
  const double x = from.origin.x_px + station_px * from.direction_x - offset_px * from.direction_y - to.origin.x_px;
  const double y = from.origin.y_px + station_px * from.direction_y + offset_px * from.direction_x - to.origin.y_px;
  return {x * to.direction_x + y * to.direction_y, y * to.direction_x - x * to.direction_y};
}

}  // namespace

Result<void> RestConfig::validate() const {
  if (!(period_ms >= 20.0 && period_ms <= 60'000.0))
    return invalid_input("period_ms: expected 20 to 60000, found {}", period_ms);
  if (!(max_motion_px > 0.0 && max_motion_px <= 1000.0))
    return invalid_input("max_motion_px: expected more than 0, at most 1000, found {}", max_motion_px);
  if (!(hold_s > 0.0 && hold_s <= 600.0))
    return invalid_input("hold_s: expected more than 0, at most 600, found {}", hold_s);
  if (!(rearm_px > max_motion_px && rearm_px <= 10'000.0))
    return invalid_input("rearm_px: expected more than max_motion_px ({}), at most 10000, found {}", max_motion_px,
                         rearm_px);
  return {};
}

std::optional<double> edge_motion_px(const Segmentation& before, const Segmentation& now) {
  const auto was = extent_px(before);
  const auto is = extent_px(now);
  if (!was || !is) return std::nullopt;
  std::vector<double> motions;
  for (int station = was->first; station <= was->second; station += static_cast<int>(kStationStep)) {
    const auto rims = rims_at(before, station - before.first_station_px);
    if (!rims) continue;
    for (const bool upper : {true, false}) {
      const StationOffset there = moved_to(now, before, station, upper ? rims->upper : rims->lower);
      const auto found = rims_at(now, std::lround(there.station_px) - now.first_station_px);
      if (found) motions.push_back(std::abs((upper ? found->upper : found->lower) - there.offset_px));
    }
  }
  if (motions.size() < kMinPlaces) return std::nullopt;
  const auto high = motions.begin() + static_cast<std::ptrdiff_t>(kShare * static_cast<double>(motions.size() - 1));
  std::ranges::nth_element(motions, high);
  const double start_px = std::abs(moved_to(now, before, was->first, 0.0).station_px - is->first);
  const double end_px = std::abs(moved_to(now, before, was->second, 0.0).station_px - is->second);
  return std::max(*high, std::min(start_px, end_px));  // pushed along, both ends move; one alone was read elsewhere
}

void RestWatch::miss(Time now) {
  standing_.reset();
  if (!missing_since_) missing_since_ = now;
  if (now - *missing_since_ >= hold()) armed_ = true;
}

bool RestWatch::note(const std::optional<Segmentation>& seen, Time now) {
  if (!seen) {
    looked_ = true;
    miss(now);
    return false;
  }
  missing_since_.reset();
  if (!std::exchange(looked_, true)) rested_ = *seen;
  const auto since_rest = rested_ ? edge_motion_px(*rested_, *seen) : std::nullopt;
  if (!rested_ || !since_rest || *since_rest > config_.rearm_px) armed_ = true;
  const auto motion = standing_ ? edge_motion_px(standing_->forging, *seen) : std::nullopt;
  if (!motion || *motion > config_.max_motion_px) {
    standing_ = Place{*seen, now};
    return false;
  }
  if (!armed_ || now - standing_->since < hold()) return false;
  armed_ = false;
  rested_ = *seen;
  return true;
}

}  // namespace imprint
