#pragma once

#include <vector>

#include "lib/camera/camera_model.h"
#include "lib/camera/camera_pose.h"
#include "lib/targets/target_field.h"
#include "node/detect/detect_targets.h"

namespace imprint {

/// A rough pose of a camera whose lens is not known yet: `nominal` is what its maker states. Where there is none, the
/// error says what would fit instead: the mirror image of the field, or another focal length.
Result<CameraPose> calibration_start(const CameraModel& nominal, const std::vector<DetectedTarget>& targets,
                                     const TargetField& field);

}  // namespace imprint
