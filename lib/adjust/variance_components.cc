#include "lib/adjust/variance_components.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace imprint {
namespace {

constexpr int kMostRounds = 100;
constexpr double kSettled = 0.005;      // relative change of the variances
constexpr double kNegligible = 0.05;    // of a centre's noise: a target's own part below it is none
constexpr double kFewestSights = 1.5;   // per target, below which noise and targets are not told apart
constexpr double kLeastNoise = 0.05;    // of the stated sigma: images that are copies of each other show no noise
constexpr double kLeastFreedom = 1e-3;  // observations to spare, below which no variance shows

// What the sights of one target sum up to, noise 1.
struct TargetSums {
  double stated_sigma_mm = 0.0;
  Eigen::MatrixXd coupling;  // shared by 3
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
};

class Components {
 public:
  Components(const std::vector<LinearSight>& sights, const std::map<int, double>& stated_sigma_mm)
      : observations_(2.0 * static_cast<double>(sights.size())) {
    const Eigen::Index shared = sights.front().by_shared.cols();
    normal_ = Eigen::MatrixXd::Zero(shared, shared);
    for (const LinearSight& sight : sights) normal_ += sight.by_shared.transpose() * sight.by_shared;
    // Pixels, radians and millimetres differ by orders of magnitude.
    const Eigen::VectorXd scale = normal_.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    normal_ = scale.asDiagonal() * normal_ * scale.asDiagonal();
    right_ = Eigen::VectorXd::Zero(shared);
    double slopes = 0.0;
    for (const LinearSight& sight : sights) {
      TargetSums& target = targets_[sight.target];
      if (target.coupling.size() == 0) target.coupling = Eigen::MatrixXd::Zero(shared, 3);
      target.coupling += scale.asDiagonal() * sight.by_shared.transpose() * sight.by_target;
      target.normal += sight.by_target.transpose() * sight.by_target;
      target.right -= sight.by_target.transpose() * sight.residual;
      right_ -= scale.asDiagonal() * sight.by_shared.transpose() * sight.residual;
      squares_ += sight.residual.squaredNorm();
      slopes += sight.by_target.squaredNorm();
    }
    for (auto& [id, target] : targets_)
      if (const auto stated = stated_sigma_mm.find(id); stated != stated_sigma_mm.end())
        target.stated_sigma_mm = stated->second;
    noise_mm_ = std::sqrt(observations_ / slopes);
  }

  VarianceComponents find() {
    const bool repeated = observations_ / 2.0 > kFewestSights * static_cast<double>(targets_.size());
    found_ = {1.0, repeated ? noise_mm_ : 0.0};
    for (int round = 0; round < kMostRounds; ++round) {
      const VarianceComponents before = found_;
      if (!improve()) break;
      const bool settled =
          std::abs(found_.noise - before.noise) < kSettled * before.noise &&
          std::abs(found_.target_sigma_mm - before.target_sigma_mm) <= kSettled * before.target_sigma_mm;
      if (found_.target_sigma_mm < kNegligible * found_.noise * noise_mm_) found_.target_sigma_mm = 0.0;
      if (settled) break;
    }
    return found_;
  }

 private:
  // One round: adjusts with the variances so far and compares what is left over with what they let expect.
  bool improve() {
    const double weight = 1.0 / (found_.noise * found_.noise);
    Eigen::MatrixXd reduced = weight * normal_;
    Eigen::VectorXd right = weight * right_;
    std::map<int, Eigen::Matrix3d> inverses;  // of the targets that are not exact
    std::map<int, double> variances_mm2;
    for (const auto& [id, target] : targets_) {
      const double variance = std::pow(target.stated_sigma_mm, 2) + std::pow(found_.target_sigma_mm, 2);
      if (!(variance > 0.0)) continue;
      const Eigen::Matrix3d inverse = (weight * target.normal + Eigen::Matrix3d::Identity() / variance).inverse();
      reduced -= weight * weight * target.coupling * inverse * target.coupling.transpose();
      right -= weight * weight * target.coupling * inverse * target.right;
      inverses[id] = inverse;
      variances_mm2[id] = variance;
    }
    const Eigen::LDLT<Eigen::MatrixXd> solver(reduced);
    const Eigen::VectorXd shared = solver.solve(right);
    const Eigen::MatrixXd covariance = solver.solve(Eigen::MatrixXd::Identity(reduced.rows(), reduced.cols()));
    if (!shared.allFinite() || !covariance.allFinite()) return false;

    double left = squares_ - 2.0 * shared.dot(right_) + shared.dot(normal_ * shared);
    double freedom = observations_ - static_cast<double>(reduced.rows());
    double found = 0.0, expected = 0.0;  // of the targets' own part
    for (const auto& [id, inverse] : inverses) {
      const TargetSums& target = targets_.at(id);
      const double variance = variances_mm2.at(id);
      const Eigen::Vector3d shift = inverse * weight * (target.right - target.coupling.transpose() * shared);
      const Eigen::MatrixXd gain = weight * inverse * target.coupling.transpose();
      const double spread = (inverse + gain * covariance * gain.transpose()).trace();
      left += shift.dot(target.normal * shift) - 2.0 * shift.dot(target.right) +
              2.0 * shift.dot(target.coupling.transpose() * shared);
      freedom -= 3.0 - spread / variance;
      found += shift.squaredNorm() / (variance * variance);
      expected += (3.0 - spread / variance) / variance;
    }
    if (!(freedom > kLeastFreedom)) return false;
    found_.noise = std::max(kLeastNoise, std::sqrt(std::max(0.0, left) / freedom));
    if (found_.target_sigma_mm > 0.0 && expected > 0.0) found_.target_sigma_mm *= std::sqrt(found / expected);
    return true;
  }

  double observations_ = 0.0, squares_ = 0.0;
  double noise_mm_ = 0.0;  // what a centre's stated sigma is in the field
  Eigen::MatrixXd normal_;
  Eigen::VectorXd right_;
  std::map<int, TargetSums> targets_;
  VarianceComponents found_;
};

}  // namespace

VarianceComponents find_variance_components(const std::vector<LinearSight>& sights,
                                            const std::map<int, double>& stated_sigma_mm) {
  if (sights.empty()) return {};
  return Components(sights, stated_sigma_mm).find();
}

}  // namespace imprint
