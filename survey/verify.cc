#include "survey/verify.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/ranges.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "lib/geometry/rotation.h"
#include "node/resect/resect.h"
#include "survey/intersect_rays.h"

namespace imprint {
namespace {

constexpr double kNoiseFloor_px = 0.05;  // as the resection's: air and lens residuals, [B] 3.3
constexpr double kMinAngle_rad = 0.02;   // below which two rays tell no depth (ours)

struct PosedView {
  const VerifyView* view = nullptr;
  CameraPose pose;
  double sigma_px = 0.0;  // of a centre, as the targets of the pose show it
};

// One ray to one target.
struct Sighting {
  std::size_t view = 0;
  IdealPoint at;
  double sigma_px = 0.0;
};

using Slope = Eigen::Matrix<double, 2, 3>;

Eigen::Vector2d residual(const PosedView& from, const Sighting& sighting, const Eigen::Vector3d& p_world,
                         Slope* by_p_cam = nullptr) {
  const double f = from.view->camera.focal_length_px;
  const Eigen::Vector3d p = from.pose.cam_from_world(p_world);
  if (by_p_cam != nullptr)
    *by_p_cam << f / p.z(), 0.0, -f * p.x() / (p.z() * p.z()), 0.0, f / p.z(), -f * p.y() / (p.z() * p.z());
  return {sighting.at.x_px - f * p.x() / p.z(), sighting.at.y_px - f * p.y() / p.z()};
}

// A target's place, and how it moves with the poses it was seen from.
struct Placed {
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();        // by the centres alone
  std::map<std::size_t, Eigen::Matrix<double, 3, 6>> by_pose;  // d(p)/d(centre, turn) of each view
};

class Verifier {
 public:
  Verifier(const std::vector<VerifyView>& views, const TargetField& field, const VerifyChecks& checks)
      : checks_(checks), field_(field) {
    for (const auto& [id, target] : checks.targets.targets) field_.targets.erase(id);
    for (const ScaleBar& bar : checks.bars) field_.targets.erase(bar.id_a), field_.targets.erase(bar.id_b);
    for (const VerifyView& view : views) pose(view);
  }

  Result<VerifyReport> run() {
    if (views_.size() < 2)
      return job_failed("verify: {} cameras could be posed, at least 2 are needed{}{}", views_.size(),
                        report_.warnings.empty() ? "" : ": ", fmt::join(report_.warnings, "; "));
    for (const ScaleBar& bar : checks_.bars) check_bar(bar);
    for (const auto& [id, target] : checks_.targets.targets) check_target(id, target);
    if (report_.checks.empty())
      return job_failed("verify: nothing could be measured: {}", fmt::join(report_.warnings, "; "));
    return std::move(report_);
  }

 private:
  void pose(const VerifyView& view) {
    const auto resection = resect(view.camera, view.targets, field_, ResectConfig{});
    if (!resection) {
      report_.warnings.push_back(resection.error().message);
      return;
    }
    views_.push_back(
        {&view, resection->pose, std::max(kNoiseFloor_px, resection->reprojection_rms_px / std::sqrt(2.0))});
  }

  Result<Placed> place(int id, std::vector<std::string>& cameras) {
    std::vector<Sighting> sightings;
    std::vector<RayWorld> rays;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const VerifyView& view = *views_[i].view;
      for (const DetectedTarget& target : view.targets) {
        if (target.id != id) continue;
        const IdealPoint ideal = undistort(view.camera, target.center);
        sightings.push_back({i, ideal, std::max(target.sigma_px, views_[i].sigma_px)});
        rays.push_back({views_[i].pose.center_world_mm, views_[i].pose.R_cam_world.transpose() *
                                                            ray_direction_cam(view.camera.focal_length_px, ideal)});
        cameras.push_back(view.camera.id);
      }
    }
    if (rays.size() < 2) return job_failed("target {} is seen by {} cameras, 2 are needed", id, rays.size());
    const auto start = intersect_rays(rays, 1.0, kMinAngle_rad);
    if (!start) return job_failed("target {}: the rays of its cameras are parallel", id);
    Placed placed;
    placed.p_mm = start->p_world_mm;
    Eigen::Matrix3d normal;
    for (int round = 0; round < 10; ++round) {
      normal.setZero();
      Eigen::Vector3d right = Eigen::Vector3d::Zero();
      for (const Sighting& s : sightings) {
        Slope by_p_cam;
        const Eigen::Vector2d r = residual(views_[s.view], s, placed.p_mm, &by_p_cam) / s.sigma_px;
        const Slope j = by_p_cam * views_[s.view].pose.R_cam_world / s.sigma_px;
        normal += j.transpose() * j;
        right += j.transpose() * r;
      }
      const Eigen::Vector3d step = normal.ldlt().solve(right);
      if (!step.allFinite()) return job_failed("target {}: its rays do not meet", id);
      placed.p_mm += step;
      if (step.norm() < 1e-9) break;
    }
    placed.covariance = normal.inverse();
    double worst = 0.0;
    for (const Sighting& s : sightings) {
      Slope by_p_cam;
      worst = std::max(worst, residual(views_[s.view], s, placed.p_mm, &by_p_cam).norm());
      const CameraPose& pose = views_[s.view].pose;
      Eigen::Matrix<double, 3, 6> p_cam_by_pose;  // d(p_cam)/d(centre, turn)
      p_cam_by_pose << -pose.R_cam_world, -cross_matrix(pose.cam_from_world(placed.p_mm));
      const Slope j = by_p_cam * pose.R_cam_world;
      placed.by_pose[s.view] =
          -placed.covariance * j.transpose() * by_p_cam * p_cam_by_pose / (s.sigma_px * s.sigma_px);
    }
    constexpr double kAnotherTarget_px = 20.0;
    if (worst > kAnotherTarget_px)
      return job_failed("target {}: its rays miss each other by {:.0f} px: a wrong id, or a camera has moved", id,
                        worst);
    return placed;
  }

  // Variance of gradient_a . a + gradient_b . b: centres apart, poses together.
  double variance(const Placed& a, const Eigen::Vector3d& gradient_a, const Placed* b,
                  const Eigen::Vector3d& gradient_b) const {
    double sum = gradient_a.dot(a.covariance * gradient_a);
    if (b != nullptr) sum += gradient_b.dot(b->covariance * gradient_b);
    for (std::size_t i = 0; i < views_.size(); ++i) {
      Vector6d by_pose = Vector6d::Zero();
      if (const auto it = a.by_pose.find(i); it != a.by_pose.end()) by_pose += it->second.transpose() * gradient_a;
      if (b != nullptr)
        if (const auto it = b->by_pose.find(i); it != b->by_pose.end()) by_pose += it->second.transpose() * gradient_b;
      sum += by_pose.dot(views_[i].pose.covariance * by_pose);
    }
    return sum;
  }

  void check_bar(const ScaleBar& bar) {
    std::vector<std::string> cameras;
    const auto a = place(bar.id_a, cameras);
    const auto b = a ? place(bar.id_b, cameras) : a;
    if (!a || !b) {
      report_.warnings.push_back(
          fmt::format("bar {}-{} is not measured: {}", bar.id_a, bar.id_b, !a ? a.error().message : b.error().message));
      return;
    }
    const Eigen::Vector3d along = (a->p_mm - b->p_mm).normalized();
    Verification check{fmt::format("bar {}-{}", bar.id_a, bar.id_b),
                       bar.length_mm,
                       (a->p_mm - b->p_mm).norm(),
                       0.0,
                       0.0,
                       unique(cameras)};
    check.deviation_mm = check.measured_mm - check.nominal_mm;
    check.ci95_mm = 1.96 * std::sqrt(variance(*a, along, &*b, -along) + bar.sigma_mm * bar.sigma_mm);
    report_.checks.push_back(std::move(check));
  }

  void check_target(int id, const FieldTarget& target) {
    std::vector<std::string> cameras;
    const auto placed = place(id, cameras);
    if (!placed) {
      report_.warnings.push_back(fmt::format("target {} is not measured: {}", id, placed.error().message));
      return;
    }
    const Eigen::Vector3d off = placed->p_mm - target.p_world_mm;
    const Eigen::Vector3d along = off.norm() > 0.0 ? Eigen::Vector3d(off.normalized()) : Eigen::Vector3d::UnitX();
    Verification check{fmt::format("target {}", id), 0.0, off.norm(), off.norm(), 0.0, unique(cameras)};
    const double stated = target.sigma_mm.value_or(0.0);
    check.ci95_mm = 1.96 * std::sqrt(variance(*placed, along, nullptr, along) + stated * stated);
    report_.checks.push_back(std::move(check));
  }

  static std::vector<std::string> unique(const std::vector<std::string>& names) {
    const std::set<std::string> set(names.begin(), names.end());
    return {set.begin(), set.end()};
  }

  const VerifyChecks& checks_;
  TargetField field_;
  std::vector<PosedView> views_;
  VerifyReport report_;
};

}  // namespace

Result<VerifyReport> verify_rig(const std::vector<VerifyView>& views, const TargetField& field,
                                const VerifyChecks& checks) {
  if (checks.bars.empty() && checks.targets.targets.empty())
    return invalid_input("verify: expected a scale bar or check targets, found none");
  return Verifier(views, field, checks).run();
}

}  // namespace imprint
