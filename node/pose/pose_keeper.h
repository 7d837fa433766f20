#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "lib/camera/camera_pose.h"
#include "lib/imprint/pose_state.h"
#include "lib/result/result.h"

namespace imprint {

struct PoseKeeperConfig {
  int min_frames = 3;              ///< without a forging, before the pose they give is kept; ours
  double drift_share = 0.1;        ///< walk of the pose from frame to frame, of one frame's own sigma: warmth; ours
  double systematic_share = 0.25;  ///< of one frame's covariance: field and lens, which no averaging removes; ours
  double moved_chi2 = 38.3;        ///< chi squared of 6 degrees of freedom that chance passes once in a million frames
  double confirmed_chi2 = 12.6;    ///< and once in twenty: below it the camera is known to stand still
  int watch_frames = 10;      ///< of a held pose, averaged to see a slow shift: air is not new in every frame; ours
  int max_blind_frames = 20;  ///< measured with a kept pose that no target confirms, before giving up; ours

  [[nodiscard]] Result<void> validate() const;
};

/// Which pose one frame is to be measured with.
struct KeptPose {
  CameraPose pose;
  PoseState state = PoseState::tracking;
  bool doubtful = false;               ///< moved in this frame, or not confirmed by any target
  std::int64_t doubtful_since_ns = 0;  ///< not 0: later frames than this, to this one, are doubtful too
  std::string note;                    ///< for the operator; empty when all is as it should be
};

/// Keeps a camera's pose from frames without a hot forging for those with one, whose air bends the rays to the targets
/// ([B] 3.4: reprojection error 2.5 times as large, changing from frame to frame; [B] 4: calibrate before it comes).
///
///   tracking: no forging in view: the pose is refined over frames by a Kalman filter that lets it walk a little.
///   hold:     a forging is in view: the pose stays; the frame's own resection is only compared with it.
///   moved:    it no longer fits, at once (a knock) or on the average of some frames (a slow shift): the frame's own
///             pose is taken, frames since the last confirmation are doubted, and tracking begins anew. Should the
///             next frame fit the former pose again, that one frame was wrong, and the former pose comes back.
///
/// Until `min_frames` frames without a forging were seen every frame is measured with its own resection, so that a
/// line that never shows an empty scene measures as without it. Depends on nothing but the frames given.
class PoseKeeper {
 public:
  explicit PoseKeeper(PoseKeeperConfig config = {}) : config_(config) {}

  /// Takes a frame's own pose (nothing: its resection failed) and whether a forging is in view.
  /// Nothing when there is no pose: none of its own, and none kept that may still be trusted.
  std::optional<KeptPose> update(const std::optional<CameraPose>& own, bool forging_in_view, std::int64_t time_ns);

  /// The kept pose, once there is one.
  [[nodiscard]] std::optional<CameraPose> kept() const;
  [[nodiscard]] PoseState state() const { return state_; }

 private:
  struct Track {
    CameraPose pose;                     // with the filter's own covariance
    Matrix6d single = Matrix6d::Zero();  // covariance of one frame
    int frames = 0;
  };
  [[nodiscard]] bool established() const { return track_ && track_->frames >= config_.min_frames; }
  [[nodiscard]] CameraPose reported() const;
  KeptPose blind();
  KeptPose follow(const CameraPose& own, std::int64_t time_ns);
  KeptPose watch(const CameraPose& own, std::int64_t time_ns);
  KeptPose move(const CameraPose& own, bool forging_in_view, std::int64_t time_ns, const char* how);
  void absorb(const CameraPose& own);
  void restart(const CameraPose& own, bool forging_in_view);
  bool take_back_former(const CameraPose& own);

  PoseKeeperConfig config_;
  PoseState state_ = PoseState::tracking;
  std::optional<Track> track_;
  std::optional<Track> former_;          // before the last move, for one frame
  Vector6d watched_ = Vector6d::Zero();  // mean shift of the frames' own poses from the held one
  int watched_frames_ = 0;
  int blind_frames_ = 0;
  std::int64_t confirmed_ns_ = 0;
};

}  // namespace imprint
