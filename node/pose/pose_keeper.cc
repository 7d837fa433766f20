#include "node/pose/pose_keeper.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace imprint {
namespace {

// From `from` to `to`, in the terms of CameraPose::covariance.
Vector6d shift_between(const CameraPose& from, const CameraPose& to) {
  Vector6d shift;
  shift.head<3>() = to.center_world_mm - from.center_world_mm;
  const Eigen::AngleAxisd turn(to.R_cam_world * from.R_cam_world.transpose());
  shift.tail<3>() = turn.angle() * turn.axis();
  return shift;
}

CameraPose shifted(const CameraPose& pose, const Vector6d& shift) {
  CameraPose result = pose;
  result.center_world_mm += shift.head<3>();
  result.R_cam_world = rotation_from_vector(shift.tail<3>()) * pose.R_cam_world;
  return result;
}

double chi2(const Vector6d& shift, const Matrix6d& covariance) { return shift.dot(covariance.ldlt().solve(shift)); }

std::string size_of(const Vector6d& shift) {
  return fmt::format("{:.2f} mm, {:.3f} mrad", shift.head<3>().norm(), 1e3 * shift.tail<3>().norm());
}

}  // namespace

Result<void> PoseKeeperConfig::validate() const {
  if (min_frames < 1 || watch_frames < 1 || max_blind_frames < 0)
    return invalid_input("pose: min_frames and watch_frames of at least 1 expected, max_blind_frames of at least 0");
  if (!(drift_share >= 0.0) || !(systematic_share >= 0.0))
    return invalid_input("pose: drift_share and systematic_share of at least 0 expected");
  if (!(confirmed_chi2 > 0.0) || !(moved_chi2 > confirmed_chi2))
    return invalid_input("pose: 0 < confirmed_chi2 < moved_chi2 expected, found {} and {}", confirmed_chi2, moved_chi2);
  return {};
}

std::optional<KeptPose> PoseKeeper::update(const std::optional<CameraPose>& own, bool forging_in_view,
                                           std::int64_t time_ns) {
  if (!own) {
    if (!established() || ++blind_frames_ > config_.max_blind_frames) return std::nullopt;
    return blind();
  }
  blind_frames_ = 0;
  if (!established() && take_back_former(*own)) return watch(*own, time_ns);
  if (!established()) {
    // Nothing to keep yet: the frame speaks for itself.
    former_.reset();
    if (!forging_in_view) {
      if (track_ &&
          chi2(shift_between(track_->pose, *own), track_->pose.covariance + own->covariance) > config_.moved_chi2)
        restart(*own, false);
      else
        absorb(*own);
      if (established()) state_ = PoseState::tracking;
    }
    confirmed_ns_ = time_ns;
    return KeptPose{*own, state_, false, 0, {}};
  }
  const Vector6d shift = shift_between(track_->pose, *own);
  if (chi2(shift, track_->pose.covariance + own->covariance) > config_.moved_chi2)
    return move(*own, forging_in_view, time_ns, "at once");
  return forging_in_view ? watch(*own, time_ns) : follow(*own, time_ns);
}

std::optional<CameraPose> PoseKeeper::kept() const {
  if (!established()) return std::nullopt;
  return reported();
}

CameraPose PoseKeeper::reported() const {
  CameraPose pose = track_->pose;
  pose.covariance += config_.systematic_share * track_->single;
  return pose;
}

KeptPose PoseKeeper::blind() {
  state_ = PoseState::hold;
  return {reported(), state_, true, 0,
          fmt::format("too few targets: measured with the pose kept, unconfirmed for {} frames", blind_frames_)};
}

// No forging in view: what was held, if anything, has been confirmed; the pose is refined.
KeptPose PoseKeeper::follow(const CameraPose& own, std::int64_t time_ns) {
  absorb(own);
  state_ = PoseState::tracking;
  confirmed_ns_ = time_ns;
  watched_frames_ = 0;
  return {reported(), state_, false, 0, {}};
}

KeptPose PoseKeeper::watch(const CameraPose& own, std::int64_t time_ns) {
  if (state_ != PoseState::hold) watched_frames_ = 0;
  state_ = PoseState::hold;
  watched_frames_ = std::min(watched_frames_ + 1, config_.watch_frames);
  const Vector6d shift = shift_between(track_->pose, own);
  if (watched_frames_ == 1) watched_.setZero();
  watched_ += (shift - watched_) / watched_frames_;
  const double mean_chi2 = chi2(watched_, track_->pose.covariance + own.covariance / watched_frames_);
  if (mean_chi2 > config_.moved_chi2) return move(own, true, time_ns, "slowly");
  if (mean_chi2 < config_.confirmed_chi2) confirmed_ns_ = time_ns;
  return {reported(), state_, false, 0, {}};
}

KeptPose PoseKeeper::move(const CameraPose& own, bool forging_in_view, std::int64_t time_ns, const char* how) {
  const Vector6d shift = shift_between(track_->pose, own);
  const std::int64_t since_ns = std::exchange(confirmed_ns_, time_ns);
  former_ = track_;
  restart(own, forging_in_view);
  state_ = PoseState::moved;
  return {own, state_, true, since_ns,
          fmt::format("the camera has moved {} by {}: pose taken anew", how, size_of(shift))};
}

void PoseKeeper::absorb(const CameraPose& own) {
  if (!track_) return restart(own, false);
  Track& track = *track_;
  track.single = own.covariance;
  const Matrix6d before = track.pose.covariance + config_.drift_share * config_.drift_share * own.covariance;
  const Matrix6d gain = (before + own.covariance).ldlt().solve(before).transpose();
  CameraPose next = shifted(track.pose, gain * shift_between(track.pose, own));
  next.covariance = (Matrix6d::Identity() - gain) * before;
  next.covariance = (0.5 * (next.covariance + next.covariance.transpose())).eval();
  track.pose = next;
  ++track.frames;
}

// A frame with a forging in view is no beginning: its air is in it.
void PoseKeeper::restart(const CameraPose& own, bool forging_in_view) {
  track_.reset();
  watched_frames_ = 0;
  if (!forging_in_view) track_ = Track{own, own.covariance, 1};
}

// After a move, once: a frame that fits the former pose again says that only the one before it was wrong.
bool PoseKeeper::take_back_former(const CameraPose& own) {
  if (!former_) return false;
  const std::optional<Track> former = std::exchange(former_, std::nullopt);
  const auto misfit = [&](const Track& track) {
    return chi2(shift_between(track.pose, own), track.pose.covariance + own.covariance);
  };
  if (misfit(*former) > config_.confirmed_chi2) return false;
  if (track_ && misfit(*track_) < misfit(*former)) return false;
  track_ = former;
  watched_frames_ = 0;
  return true;
}

}  // namespace imprint
