#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "lib/result/result.h"
#include "node/capture/exposure.h"
#include "node/capture/pixel_format.h"

namespace imprint {

/// A picture in the camera's own buffer, which goes back to the camera with the last copy of this.
struct RawFrame {
  PixelLayout layout;
  std::span<const std::uint8_t> bytes;  ///< valid as long as `buffer`
  std::shared_ptr<const void> buffer;
  std::int64_t sensor_time_ns = 0;  ///< when it was taken, by this machine's wall clock
  std::uint64_t sequence = 0;       ///< as the camera counts
  std::uint64_t missed = 0;         ///< frames between the one before and this that never came
  bool damaged = false;             ///< the camera or the link says that content is missing
  Exposure exposure{};
};

/// A camera that is open and takes pictures; ends it when it goes. One thread waits for frames; `set_exposure` and
/// `fire` may be called from another.
class CameraStream {
 public:
  virtual ~CameraStream() = default;
  /// The next frame; nothing when none came within the timeout. Fails (job_failed) when the camera is lost: there will
  /// be no further frame, and it must be opened anew.
  virtual Result<std::optional<RawFrame>> next(std::chrono::milliseconds timeout) = 0;
  /// Fails (job_failed) when the camera does not take it.
  virtual Result<void> set_exposure(const Exposure& exposure) = 0;
  [[nodiscard]] virtual Exposure exposure() const = 0;
  /// With CameraTrigger::software: takes one picture.
  virtual Result<void> fire() = 0;
};

/// Opens the camera anew, with this exposure unless its time is 0.
using OpenStream = std::function<Result<std::unique_ptr<CameraStream>>(const Exposure& exposure)>;

}  // namespace imprint
