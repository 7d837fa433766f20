#include "node/capture/frame_ring.h"

#include <algorithm>
#include <utility>

namespace imprint {

void FrameRing::add(RawFrame frame) {
  // A clock set back: what was taken before cannot be told from what comes.
  if (!frames_.empty() && frame.sensor_time_ns < frames_.back().sensor_time_ns) frames_.clear();
  frames_.push_back(std::move(frame));
  while (frames_.size() > capacity_) frames_.pop_front();
}

std::optional<RawFrame> FrameRing::first_since(std::int64_t moment_ns) const {
  const auto found = std::ranges::find_if(frames_, [&](const auto& f) { return f.sensor_time_ns >= moment_ns; });
  if (found == frames_.end()) return std::nullopt;
  return *found;
}

std::optional<RawFrame> FrameRing::nearest(std::int64_t moment_ns) const {
  const auto after = std::ranges::find_if(frames_, [&](const auto& f) { return f.sensor_time_ns >= moment_ns; });
  if (after == frames_.end()) return std::nullopt;
  if (after == frames_.begin()) return *after;
  const auto before = std::prev(after);
  return moment_ns - before->sensor_time_ns < after->sensor_time_ns - moment_ns ? *before : *after;
}

bool FrameRing::reaches_back_to(std::int64_t moment_ns) const {
  if (frames_.empty()) return false;
  if (frames_.front().sensor_time_ns <= moment_ns) return true;
  // Before the oldest by less than half the time to the next: no other can have been nearer.
  if (frames_.size() < 2) return false;
  return frames_.front().sensor_time_ns - moment_ns <= (frames_[1].sensor_time_ns - frames_[0].sensor_time_ns) / 2;
}

std::optional<std::int64_t> FrameRing::oldest_ns() const {
  if (frames_.empty()) return std::nullopt;
  return frames_.front().sensor_time_ns;
}

}  // namespace imprint
