#pragma once

#include <linux/videodev2.h>

#include "lib/result/result.h"
#include "node/capture/camera_settings.h"
#include "node/capture/v4l2_device.h"

namespace imprint {

/// Captures in one plane, or through the interface for several of which grey needs one.
enum class V4l2Planes { single, multi };

inline std::uint32_t buffer_type(V4l2Planes planes) {
  return planes == V4l2Planes::multi ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
}

/// Fails (job_failed) on a device that does not capture or not stream.
Result<V4l2Planes> v4l2_planes(V4l2Device& device);

/// Sets input, format, size and rate. Fails (job_failed) saying what the device offers or gave instead.
Result<PixelLayout> set_v4l2_format(V4l2Device& device, V4l2Planes planes, const CameraSettings& settings);

}  // namespace imprint
