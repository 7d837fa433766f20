#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lib/imprint/imprint.h"
#include "lib/result/result.h"
#include "lib/rig/rig.h"
#include "node/capture/frame.h"
#include "node/edge/locate_edges.h"
#include "node/imprint/make_imprint.h"
#include "node/pose/pose_keeper.h"
#include "node/resect/resect.h"

namespace imprint {

/// What the stages of one frame produced and how long each took; `imprint` always has quality and,
/// where a stage failed, `failure` instead of curves.
struct ProcessedFrame {
  Imprint imprint;
  std::optional<Error> error;
  std::vector<DetectedTarget> targets;
  std::optional<Resection> resection;
  std::optional<Silhouette> edges;  ///< as found, before they were filtered
  std::optional<FilteredSilhouette> silhouette;
  std::vector<std::pair<std::string, std::chrono::microseconds>> stage_times;
};

/// One camera's frame through all stages: detect, resect, segment, pose, edge, imprint.
/// The only file that wires the stages; a pure call without clock (but for the stage times), file or global: what it
/// remembers is in `keeper`. Without one, or before that has a pose to keep, the frame's own resection is used.
ProcessedFrame process_frame(const Frame& frame, const CameraModel& camera, const Rig& rig, EdgeMethod method,
                             PoseKeeper* keeper = nullptr);

}  // namespace imprint
