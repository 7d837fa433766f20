#pragma once

#include <memory>

#include "lib/result/result.h"
#include "node/capture/camera_settings.h"
#include "node/capture/camera_stream.h"

namespace imprint {

/// Opens a GigE Vision or USB3 Vision camera through Aravis and starts it; settings go by their GenICam names. Fails
/// (job_failed) naming the camera and the feature it would not take.
///
/// Sensor time is when the frame's first packet came, by this machine's clock. Damaged frames (packets that did not
/// come even when asked for again) say so; missed frames are the gaps in the camera's frame ids.
Result<std::unique_ptr<CameraStream>> open_aravis_stream(const CameraSettings& settings);

/// Whole frames that a camera has sent between ids `last` and `next`: ids of GigE Vision 1 have 16 bits, and 0 is none.
std::uint64_t missed_between(std::uint64_t last, std::uint64_t next);

}  // namespace imprint
