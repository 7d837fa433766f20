#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "lib/result/result.h"

namespace imprint {

/// What a V4l2Stream asks of the kernel; a test has a device without hardware. Calls give 0 or the kernel's errno.
class V4l2Device {
 public:
  virtual ~V4l2Device() = default;
  /// ioctl; `argument` is the request's struct.
  virtual int call(unsigned long request, void* argument) = 0;
  /// Waits until there is a buffer, or something is wrong with the device: 0. ETIMEDOUT: neither.
  virtual int wait(std::chrono::milliseconds timeout) = 0;
  /// A buffer's memory, unmapped when the last copy goes; null when it cannot be mapped.
  virtual std::shared_ptr<std::uint8_t> map(std::size_t length, std::int64_t offset) = 0;
};

using OpenV4l2Device = std::function<Result<std::shared_ptr<V4l2Device>>(const std::string& path)>;

/// A device of this machine. Fails (job_failed) naming it and why.
Result<std::shared_ptr<V4l2Device>> open_v4l2_device(const std::string& path);

}  // namespace imprint
