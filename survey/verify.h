#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "lib/camera/camera_model.h"
#include "lib/result/result.h"
#include "lib/targets/target_field.h"
#include "node/detect/detect_targets.h"
#include "survey/scale_bar.h"

namespace imprint {

/// What one of the rig's cameras saw, at the same time as the others.
struct VerifyView {
  CameraModel camera;
  std::vector<DetectedTarget> targets;
};

/// What is known and to be measured: lengths between two targets, and targets whose place is known.
struct VerifyChecks {
  std::vector<ScaleBar> bars;
  TargetField targets;
};

/// One thing checked.
struct Verification {
  std::string what;           ///< "bar 101-102" or "target 7"
  double nominal_mm = 0.0;    ///< length of the bar; 0 of a target
  double measured_mm = 0.0;   ///< length of the bar; distance of the target from its place
  double deviation_mm = 0.0;  ///< measured less nominal
  double ci95_mm = 0.0;       ///< of the deviation: centres, poses and what was stated of the nominal
  std::vector<std::string> cameras;
};

struct VerifyReport {
  std::vector<Verification> checks;
  std::vector<std::string> warnings;  ///< what could not be measured, and why
};

/// Measures `checks` with calibrated cameras, each posed by the field's targets in its own image; targets to be checked
/// are left out of the poses. Of every camera that sees a target the ray counts; two are needed.
/// Fails (job_failed) when fewer than two cameras can be posed or nothing could be measured, with the reasons.
Result<VerifyReport> verify_rig(const std::vector<VerifyView>& views, const TargetField& field,
                                const VerifyChecks& checks);

}  // namespace imprint
