#pragma once

#include <string>
#include <vector>

#include "lib/result/result.h"
#include "lib/targets/target_field.h"
#include "node/detect/detect_targets.h"
#include "simulation/layout.h"
#include "simulation/scene.h"
#include "tests/paper/calibration/paper_cameras.h"

namespace imprint::paper {

/// Rendered frames with what our detector finds in them, and the truth: one entry a frame, observation by observation.
struct RenderedSet {
  Scene scene;
  TargetField field;                                  ///< exact
  std::vector<CameraPose> poses;                      ///< true, by camera
  std::vector<std::vector<DetectedTarget>> detected;  ///< [observation * cameras + camera]
};

/// The calibration field of one camera: seven frames from one place, the camera rolled from each to the next, [B] 2.3.
Result<RenderedSet> render_calibration(const PublishedScale& scale, std::size_t camera, unsigned seed, int jobs);

/// Both cameras in their places, [B] 3.3: about 28 targets each; `observations` frames. `hot`: with a glowing forging
/// and the haze of its air, else both are off.
Result<RenderedSet> render_pair(const PublishedScale& scale, bool hot, int observations, unsigned seed, int jobs);

}  // namespace imprint::paper
