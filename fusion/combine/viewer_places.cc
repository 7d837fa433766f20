#include "fusion/combine/viewer_places.h"

#include <cmath>

#include <Eigen/Dense>

#include "lib/geometry/rotation.h"

namespace imprint {

ViewerPlaces::ViewerPlaces(std::vector<Viewer> viewers, std::vector<Placement> placements, double length_mm,
                           double radius_mm, double shift_sigma_mm, const CombineConfig& config)
    : viewers_(std::move(viewers)),
      placements_(std::move(placements)),
      length_mm_(length_mm),
      radius_mm_(radius_mm),
      place_sum_(placements_.size(), Vector6d::Zero()),
      cameras_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(viewers_.size()) * kCameraUnknowns)) {
  constexpr double kTilt = 0.02;
  place_sigma_ << shift_sigma_mm, config.placing_sigma_mm, config.placing_sigma_mm,
      config.rotation_tolerance_deg * M_PI / 180.0, kTilt, kTilt;
}

int ViewerPlaces::unknowns() const {
  return static_cast<int>(viewers_.size()) * kCameraUnknowns +
         static_cast<int>(placements_.size() - 1) * kPlaceUnknowns;
}

void ViewerPlaces::add_priors(const Eigen::Vector2d& first, const Eigen::Vector2d& last, Eigen::MatrixXd& corner,
                              Eigen::VectorXd& border_right) const {
  for (std::size_t v = 0; v < viewers_.size(); ++v) {
    const Viewer& viewer = viewers_[v];
    const Eigen::Matrix3d& R = placements_[viewer.observation].R;
    const Eigen::Vector3d center = center_of(v);
    Eigen::Matrix<double, 2, 6> effect;
    for (int end = 0; end < 2; ++end) {
      const Eigen::Vector2d& yz = end == 0 ? first : last;
      const Eigen::Vector3d view = Eigen::Vector3d(end * length_mm_, yz.x(), yz.y()) - center;
      const Eigen::Vector3d across = R.transpose() * view.cross(Eigen::Vector3d::UnitX()).normalized();
      const Eigen::Vector3d point_cam = viewer.R_cam_world * R.transpose() * view;
      effect.block<1, 3>(end, 0) = across.transpose();
      effect.block<1, 3>(end, 3) = -point_cam.cross(viewer.R_cam_world * across).transpose();
    }
    Eigen::Matrix2d covariance = effect * viewer.pose_covariance * effect.transpose();
    covariance.diagonal().array() += std::pow(1e-5 * radius_mm_, 2);
    corner.block<2, 2>(camera_column(v), camera_column(v)) += covariance.inverse();
  }
  for (std::size_t k = 1; k < placements_.size(); ++k) {
    for (int j = 0; j < kPlaceUnknowns; ++j) {
      const double information = 1.0 / (place_sigma_(j) * place_sigma_(j));
      corner(place_column(k) + j, place_column(k) + j) += information;
      border_right(place_column(k) + j) -= information * place_sum_[k](j);
    }
  }
}

double ViewerPlaces::made_by_places(const PlacedEquation& equation, std::size_t viewer,
                                    const Eigen::VectorXd& solution) const {
  const int camera = camera_column(viewer);
  double made = equation.camera * ((1.0 - equation.along) * solution(camera) + equation.along * solution(camera + 1));
  if (viewers_[viewer].observation > 0)
    made += equation.place.dot(solution.segment<kPlaceUnknowns>(place_column(viewers_[viewer].observation)));
  return made;
}

void ViewerPlaces::take(const Eigen::VectorXd& solution) {
  cameras_ = solution.head(cameras_.size());
  const Eigen::Vector3d middle(0.5 * length_mm_, 0.0, 0.0);
  for (std::size_t k = 1; k < placements_.size(); ++k) {
    const Vector6d move = solution.segment<kPlaceUnknowns>(place_column(k));
    place_sum_[k] += move;
    const Eigen::Matrix3d turn = rotation_from_vector(move.tail<3>());
    placements_[k].R = turn * placements_[k].R;
    placements_[k].shift_mm = turn * (placements_[k].shift_mm - middle) + middle + move.head<3>();
  }
}

Eigen::VectorXd ViewerPlaces::held() const {
  Eigen::VectorXd values = Eigen::VectorXd::Zero(unknowns());
  values.head(cameras_.size()) = cameras_;
  return values;
}

std::vector<double> ViewerPlaces::shift_sigma_mm(const Eigen::MatrixXd& border_covariance) const {
  std::vector<double> sigma(placements_.size(), 0.0);
  for (std::size_t k = 1; k < placements_.size(); ++k)
    sigma[k] = std::sqrt(border_covariance(place_column(k), place_column(k)));
  return sigma;
}

}  // namespace imprint
