#include "survey/bundle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <ceres/ceres.h>
#include <glog/logging.h>
#include <Eigen/LU>

#include "lib/adjust/collinearity_error.h"
#include "lib/geometry/rotation.h"

namespace imprint {
namespace {

using Interior = std::array<double, kInteriorTerms>;

// What is known of any camera, as standard deviations (ours): weak enough to vanish beside photographs that show a
// constant, strong enough to keep the others from drifting where no photograph was taken with the camera rolled.
constexpr double kFocalShare = 0.3, kPrincipalPointShare = 0.05;  // of the focal length; of half the shorter side
constexpr double kRadial = 0.2, kTangential = 0.01, kAffine = 5e-4;

struct InteriorExpectation {
  Interior expected, sigma;

  template <class T>
  bool operator()(const T* interior, T* residual) const {
    for (int k = 0; k < kInteriorTerms; ++k)
      residual[k] = (interior[k] - expected[static_cast<std::size_t>(k)]) / sigma[static_cast<std::size_t>(k)];
    return true;
  }
};

struct BarError {
  double length_mm, sigma_mm;

  template <class T>
  bool operator()(const T* a, const T* b, T* residual) const {
    const T d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    const T squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (!(squared > T(0))) return false;
    residual[0] = (sqrt(squared) - length_mm) / sigma_mm;
    return true;
  }
};

Interior interior_of(const CameraModel& camera) {
  Interior values{camera.focal_length_px, camera.principal_point.x_px, camera.principal_point.y_px};
  const auto terms = camera.distortion.terms();
  std::copy(terms.begin(), terms.end(), values.begin() + 3);
  return values;
}

InteriorExpectation expectation(const CameraModel& camera) {
  const double n = camera.normalizer_px();
  InteriorExpectation e{};
  e.expected = {camera.focal_length_px, 0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)};
  e.sigma = {kFocalShare * camera.focal_length_px,
             kPrincipalPointShare * n,
             kPrincipalPointShare * n,
             kRadial,
             kRadial,
             kRadial,
             kTangential,
             kTangential,
             kAffine,
             kAffine};
  return e;
}

// The unknowns as Ceres takes them, and the problem that ties them.
class Bundle {
 public:
  Bundle(const Network& network, const std::vector<Sight>& sights, const std::vector<ScaleBar>& bars, double cauchy_px)
      : camera_(network.camera), interior_(interior_of(network.camera)), points_(network.points) {
    for (const auto& pose : network.poses) {
      turns_.emplace_back();
      centers_.emplace_back();
      if (!pose) continue;
      ceres::RotationMatrixToAngleAxis(pose->R_cam_world.data(), turns_.back().data());  // both by columns
      std::copy_n(pose->center_world_mm.data(), 3, centers_.back().data());
    }
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<InteriorExpectation, kInteriorTerms, kInteriorTerms>(
                                  new InteriorExpectation(expectation(network.camera))),
                              nullptr, interior_.data());
    for (const Sight& sight : sights) {
      if (!network.holds(sight) || (cauchy_px <= 0.0 && !sight.used)) continue;
      auto* cost = new ceres::AutoDiffCostFunction<CollinearityError, 2, kInteriorTerms, 3, 3, 3>(
          new CollinearityError{sight.at, sight.sigma_px, camera_.normalizer_px(), camera_.distortion.r0});
      auto* loss = cauchy_px > 0.0 ? new ceres::CauchyLoss(std::max(3.0, cauchy_px / sight.sigma_px)) : nullptr;
      problem_.AddResidualBlock(cost, loss, interior_.data(), turns_[sight.photo].data(), centers_[sight.photo].data(),
                                points_.at(sight.id).data());
      ++sights_;
    }
    for (const ScaleBar& bar : bars) {
      const auto a = points_.find(bar.id_a), b = points_.find(bar.id_b);
      if (a == points_.end() || b == points_.end()) continue;
      if (!problem_.HasParameterBlock(a->second.data()) || !problem_.HasParameterBlock(b->second.data())) continue;
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<BarError, 1, 3, 3>(new BarError{bar.length_mm, bar.sigma_mm}), nullptr,
          a->second.data(), b->second.data());
      ++bars_;
    }
  }

  bool solve(const BundleOptions& options) {
    if (options.interior == FreeInterior::none) problem_.SetParameterBlockConstant(interior_.data());
    if (options.interior == FreeInterior::focal_and_radial)
      problem_.SetManifold(interior_.data(), new ceres::SubsetManifold(kInteriorTerms, {1, 2, 4, 5, 6, 7, 8, 9}));
    ceres::Solver::Options how;
    how.linear_solver_type = ceres::SPARSE_SCHUR;
    how.max_num_iterations = options.max_iterations;
    const bool rough = options.cauchy_px > 0.0;
    how.function_tolerance = rough ? 1e-8 : 1e-14;
    how.parameter_tolerance = rough ? 1e-8 : 1e-13;
    how.gradient_tolerance = 1e-14;
    how.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(how, &problem_, &summary);
    return summary.IsSolutionUsable();
  }

  void give_back(Network& network) const {
    network.camera.focal_length_px = interior_[0];
    network.camera.principal_point = {interior_[1], interior_[2]};
    std::copy_n(interior_.data() + 3, 3, network.camera.distortion.radial.begin());
    std::copy_n(interior_.data() + 6, 2, network.camera.distortion.tangential.begin());
    std::copy_n(interior_.data() + 8, 2, network.camera.distortion.affine.begin());
    network.points = points_;
    for (std::size_t i = 0; i < network.poses.size(); ++i) {
      if (!network.poses[i]) continue;
      network.poses[i]->R_cam_world = rotation_from_vector(Eigen::Vector3d::Map(turns_[i].data()));
      network.poses[i]->center_world_mm = Eigen::Vector3d::Map(centers_[i].data());
    }
  }

  // Unknowns in the order interior, points, poses; only what a sight ties.
  Result<NetworkPrecision> precision() {
    NetworkPrecision result;
    ceres::Problem::EvaluateOptions what;
    what.parameter_blocks.push_back(interior_.data());
    Eigen::Index unknowns = kInteriorTerms;
    for (auto& [id, p] : points_) {
      if (!problem_.HasParameterBlock(p.data())) continue;
      what.parameter_blocks.push_back(p.data());
      result.first_row[id] = unknowns - kInteriorTerms;
      unknowns += 3;
    }
    for (std::size_t i = 0; i < turns_.size(); ++i) {
      if (!problem_.HasParameterBlock(turns_[i].data())) continue;
      what.parameter_blocks.push_back(turns_[i].data());
      what.parameter_blocks.push_back(centers_[i].data());
      unknowns += 6;
    }
    ceres::CRSMatrix jacobian;
    double cost = 0.0;
    if (!problem_.Evaluate(what, &cost, nullptr, nullptr, &jacobian))
      return job_failed("survey: the adjusted network cannot be evaluated");
    result.weighted_squares = 2.0 * cost;
    const Eigen::Index of_points = static_cast<Eigen::Index>(3 * result.first_row.size());
    const int datum = bars_ > 0 ? 6 : 7;
    result.redundancy = static_cast<double>(2 * sights_ + bars_ + datum) - static_cast<double>(unknowns);
    if (result.redundancy < 1.0)
      return job_failed("survey: {} sights of {} targets are too few to measure them; take more photographs", sights_,
                        result.first_row.size());
    const Eigen::MatrixXd inverse = invert(normal_matrix(jacobian, unknowns),
                                           inner_constraints(result, unknowns, datum), kInteriorTerms + of_points);
    if (!inverse.allFinite() || inverse.diagonal().minCoeff() < 0.0)
      return job_failed("survey: the photographs leave the targets' places open; take more, from other directions");
    result.interior = inverse.topLeftCorner<kInteriorTerms, kInteriorTerms>();
    result.points = inverse.bottomRightCorner(of_points, of_points);
    return result;
  }

 private:
  static Eigen::MatrixXd normal_matrix(const ceres::CRSMatrix& jacobian, Eigen::Index unknowns) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
    for (int row = 0; row < jacobian.num_rows; ++row) {
      const auto first = static_cast<std::size_t>(jacobian.rows[static_cast<std::size_t>(row)]);
      const auto last = static_cast<std::size_t>(jacobian.rows[static_cast<std::size_t>(row) + 1]);
      for (std::size_t i = first; i < last; ++i)
        for (std::size_t j = first; j < last; ++j)
          normal(jacobian.cols[i], jacobian.cols[j]) += jacobian.values[i] * jacobian.values[j];
    }
    return normal;
  }

  // Columns along which moving all points together is a change of the frame alone.
  Eigen::MatrixXd inner_constraints(const NetworkPrecision& precision, Eigen::Index unknowns, int datum) const {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const auto& [id, row] : precision.first_row) middle += points_.at(id);
    middle /= static_cast<double>(precision.first_row.size());
    Eigen::MatrixXd constraints = Eigen::MatrixXd::Zero(unknowns, datum);
    for (const auto& [id, row] : precision.first_row) {
      const Eigen::Vector3d p = points_.at(id) - middle;
      auto block = constraints.middleRows(kInteriorTerms + row, 3);
      block.leftCols<3>().setIdentity();
      block.middleCols<3>(3) = cross_matrix(p);
      if (datum == 7) block.col(6) = p;
    }
    constraints.colwise().normalize();
    return constraints;
  }

  // The first `wanted` rows and columns of the inverse of the bordered normal matrix.
  static Eigen::MatrixXd invert(const Eigen::MatrixXd& normal, const Eigen::MatrixXd& constraints,
                                Eigen::Index wanted) {
    const Eigen::Index n = normal.rows(), d = constraints.cols();
    const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    Eigen::MatrixXd bordered = Eigen::MatrixXd::Zero(n + d, n + d);
    bordered.topLeftCorner(n, n) = scale.asDiagonal() * normal * scale.asDiagonal();
    const Eigen::MatrixXd scaled = (scale.asDiagonal() * constraints).eval();
    const Eigen::RowVectorXd sizes = scaled.colwise().norm();
    bordered.topRightCorner(n, d) = scaled * sizes.cwiseInverse().asDiagonal();
    bordered.bottomLeftCorner(d, n) = bordered.topRightCorner(n, d).transpose();
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n + d, wanted);
    right.topRows(wanted).setIdentity();
    const Eigen::MatrixXd solved = bordered.partialPivLu().solve(right);
    return scale.head(wanted).asDiagonal() * solved.topRows(wanted) * scale.head(wanted).asDiagonal();
  }

  CameraModel camera_;
  Interior interior_;
  std::map<int, Eigen::Vector3d> points_;
  std::vector<std::array<double, 3>> turns_, centers_;
  ceres::Problem problem_;
  int sights_ = 0, bars_ = 0;
};

}  // namespace

void find_residuals(const Network& network, std::vector<Sight>& sights) {
  for (Sight& sight : sights) {
    if (!network.holds(sight)) continue;
    const Eigen::Vector3d p = network.poses[sight.photo]->cam_from_world(network.points.at(sight.id));
    if (p.z() <= 0.0) {
      sight.residual_px.setConstant(1e6);
      continue;
    }
    const ObservedPoint expected = project(network.camera, p);
    sight.residual_px = {sight.at.x_px - expected.x_px, sight.at.y_px - expected.y_px};
  }
}

Result<void> adjust_network(Network& network, std::vector<Sight>& sights, const std::vector<ScaleBar>& bars,
                            const BundleOptions& options) {
  FLAGS_minloglevel = google::GLOG_ERROR;  // a trial that fails is not for the person who waits
  Bundle bundle(network, sights, bars, options.cauchy_px);
  if (!bundle.solve(options)) return job_failed("survey: the adjustment came to no solution");
  bundle.give_back(network);
  find_residuals(network, sights);
  return {};
}

Eigen::Matrix3d NetworkPrecision::of_point(int id) const {
  const Eigen::Index row = first_row.at(id);
  return points.block<3, 3>(row, row);
}

double NetworkPrecision::distance_variance(const Network& network, int a, int b) const {
  const Eigen::Vector3d along = (network.points.at(a) - network.points.at(b)).normalized();
  const Eigen::Index i = first_row.at(a), j = first_row.at(b);
  const Eigen::Matrix3d difference =
      points.block<3, 3>(i, i) + points.block<3, 3>(j, j) - points.block<3, 3>(i, j) - points.block<3, 3>(j, i);
  return along.dot(difference * along);
}

Result<NetworkPrecision> network_precision(const Network& network, const std::vector<Sight>& sights,
                                           const std::vector<ScaleBar>& bars) {
  return Bundle(network, sights, bars, 0.0).precision();
}

}  // namespace imprint
