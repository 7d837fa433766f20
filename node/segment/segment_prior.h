#pragma once

#include "lib/camera/camera_model.h"
#include "lib/camera/camera_pose.h"
#include "lib/rig/rig.h"
#include "node/segment/segment.h"

namespace imprint {

/// Where and how large the forging can look in the observed image of a camera with this pose: its axis direction as
/// seen at the field's middle, its width for all distances from 0.6 to 1.5 times that of the field's middle.
/// Fails (job_failed) when the camera looks along the axis or the field lies behind it.
Result<SegmentPrior> make_segment_prior(const CameraModel& camera, const CameraPose& pose, const ForgingSpec& forging,
                                        const TargetField& field);

}  // namespace imprint
