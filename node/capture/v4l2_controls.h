#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "lib/result/result.h"
#include "node/capture/camera_settings.h"
#include "node/capture/v4l2_device.h"

namespace imprint {

/// The controls of a device by name, as v4l2-ctl writes them ("exposure_time_absolute"): what is there differs from
/// camera to camera, and so do the units.
class V4l2Controls {
 public:
  explicit V4l2Controls(std::shared_ptr<V4l2Device> device);

  /// Fails (job_failed) naming what there is, or the range.
  Result<void> set(const std::string& name, std::int64_t value);
  Result<void> set(const CameraControl& control);
  [[nodiscard]] Result<std::int64_t> get(const std::string& name) const;
  [[nodiscard]] bool has(const std::string& name) const { return controls_.contains(name); }

 private:
  struct Control {
    std::uint32_t id = 0;
    std::int64_t lowest = 0;
    std::int64_t highest = 0;
    bool button = false;
    bool wide = false;  // 64 bit
  };
  std::shared_ptr<V4l2Device> device_;
  std::map<std::string, Control> controls_;
};

}  // namespace imprint
