#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "node/capture/camera_stream.h"

namespace imprint {

/// The newest frames of a camera, in its own buffers, so that a trigger whose moment has just passed can be served.
class FrameRing {
 public:
  explicit FrameRing(std::size_t capacity) : capacity_(capacity) {}

  void add(RawFrame frame);
  void clear() { frames_.clear(); }

  /// The first taken at or after the moment; none when there is none yet.
  [[nodiscard]] std::optional<RawFrame> first_since(std::int64_t moment_ns) const;
  /// The one taken nearest to the moment; none as long as a nearer one may still come.
  [[nodiscard]] std::optional<RawFrame> nearest(std::int64_t moment_ns) const;
  /// Whether a frame of that moment is, or was never, here: false when it has been and is gone.
  [[nodiscard]] bool reaches_back_to(std::int64_t moment_ns) const;
  [[nodiscard]] std::optional<std::int64_t> oldest_ns() const;

 private:
  std::size_t capacity_;
  std::deque<RawFrame> frames_;  // by time
};

}  // namespace imprint
