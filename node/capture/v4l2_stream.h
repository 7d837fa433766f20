#pragma once

#include <memory>

#include "lib/result/result.h"
#include "node/capture/camera_settings.h"
#include "node/capture/camera_stream.h"
#include "node/capture/v4l2_device.h"

namespace imprint {

/// Opens a Video4Linux camera and starts it: input, format, rate, controls and exposure as the settings say, frames in
/// memory shared with the driver; devices with one plane or with the interface for several. Fails (job_failed) naming
/// the device and, where it would not take a setting, what it offers.
///
/// Sensor time is the driver's stamp (most take it at the end of the frame's readout), moved from the machine's
/// monotonic clock to the wall clock. Missed frames are the gaps in the driver's sequence.
Result<std::unique_ptr<CameraStream>> open_v4l2_stream(const CameraSettings& settings,
                                                       const OpenV4l2Device& open = open_v4l2_device);

}  // namespace imprint
