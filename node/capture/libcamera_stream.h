#pragma once

#include <memory>

#include "lib/result/result.h"
#include "node/capture/camera_settings.h"
#include "node/capture/camera_stream.h"

namespace imprint {

/// Opens a camera through libcamera (0.0.3 to 0.7) and starts it: one stream, its raw one where that has the format,
/// controls by libcamera's names. Fails (job_failed) naming the camera and, where it would not take a setting, what it
/// offers.
///
/// Sensor time is SensorTimestamp (start of the frame's exposure or readout, as the pipeline has it), moved from the
/// machine's monotonic clock to the wall clock. Missed frames are the gaps in the driver's sequence. The exposure of a
/// frame is what its metadata say, else what was asked for when it was queued.
Result<std::unique_ptr<CameraStream>> open_libcamera_stream(const CameraSettings& settings);

}  // namespace imprint
