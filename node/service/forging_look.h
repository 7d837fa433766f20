#pragma once

#include <optional>

#include "lib/camera/camera_pose.h"
#include "lib/rig/rig.h"
#include "node/capture/frame.h"
#include "node/node_pipeline.h"
#include "node/segment/segment.h"

namespace imprint {

/// Looks at a frame for the forging alone, without measuring: the pose is that of the last frame in which one was
/// known, and only without one are the targets looked for. To be called from one thread at a time.
class ForgingLook {
 public:
  ForgingLook(const Rig& rig, const CameraModel& camera) : rig_(rig), camera_(camera) {}

  /// Keeps the pose of a frame that was measured.
  void learn(const ProcessedFrame& measured);
  /// The forging roughly; nothing when none is seen, or no pose could be had.
  std::optional<Segmentation> see(const Frame& frame);

 private:
  const Rig& rig_;
  const CameraModel& camera_;
  std::optional<CameraPose> pose_;
};

}  // namespace imprint
