#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "fusion/combine/alignment.h"
#include "fusion/combine/bordered_system.h"
#include "fusion/combine/combine_config.h"

namespace imprint {

/// One camera of one observation.
struct Viewer {
  std::size_t observation = 0;
  Eigen::Vector3d center_world_mm = Eigen::Vector3d::Zero();
  Matrix6d pose_covariance = Matrix6d::Zero();
  Eigen::Matrix3d R_cam_world = Eigen::Matrix3d::Identity();
};

/// A tangent as a linear equation of the two nodes beside it (their coefficients stand elsewhere) and of the places
/// of its camera and its observation: what they make of it = value_mm.
struct PlacedEquation {
  std::size_t node = 0;
  double share = 0.0;  ///< of the next node
  double along = 0.0;  ///< share of the length
  double value_mm = 0.0;
  double camera = 0.0;                ///< effect of the camera's place across the axis
  Vector6d place = Vector6d::Zero();  ///< effect of the observation's place: shift, turn about the middle
};

/// Where cameras and observations stand, as the border's unknowns of a joint estimate: of each camera of each
/// observation its place across the axis at both ends, within its pose's covariance; of each observation but the first
/// its shift (free across the axis) and its turn (within the manipulator's tolerance).
class ViewerPlaces {
 public:
  /// `shift_sigma_mm`: how well the ends fix each observation along x.
  ViewerPlaces(std::vector<Viewer> viewers, std::vector<Placement> placements, double length_mm, double radius_mm,
               double shift_sigma_mm, const CombineConfig& config);

  [[nodiscard]] int unknowns() const;
  [[nodiscard]] const std::vector<Viewer>& viewers() const { return viewers_; }
  [[nodiscard]] const std::vector<Placement>& placements() const { return placements_; }
  [[nodiscard]] const Placement& placement_of(std::size_t viewer) const {
    return placements_[viewers_[viewer].observation];
  }
  /// The camera's centre where the forging is.
  [[nodiscard]] Eigen::Vector3d center_of(std::size_t viewer) const {
    return placement_of(viewer).point(viewers_[viewer].center_world_mm);
  }

  /// What is known of the places before anything is seen. `first` and `last`: (y, z) of the axis at both ends.
  void add_priors(const Eigen::Vector2d& first, const Eigen::Vector2d& last, Eigen::MatrixXd& corner,
                  Eigen::VectorXd& border_right) const;
  /// Share of an equation's value that the places make, by a border's solution.
  [[nodiscard]] double made_by_places(const PlacedEquation& equation, std::size_t viewer,
                                      const Eigen::VectorXd& solution) const;
  /// Takes over a border's solution: moves the observations.
  void take(const Eigen::VectorXd& solution);
  /// The border's unknowns as they are after `take`: cameras where they were found, observations not moved further.
  [[nodiscard]] Eigen::VectorXd held() const;
  /// Of each observation along x, 0 for the first.
  [[nodiscard]] std::vector<double> shift_sigma_mm(const Eigen::MatrixXd& border_covariance) const;

  /// Adds an equation of weight `w`, with `g` the coefficients of its nodes, for these alone: the places are held where
  /// they were found.
  template <int kUnknowns>
  void add_held(BorderedChain<kUnknowns>& system, const typename BorderedChain<kUnknowns>::Vector& g,
                const PlacedEquation& equation, std::size_t viewer, double w) const {
    add_to_nodes(system, g, equation, equation.value_mm - made_by_cameras(equation, viewer), w);
  }
  /// Adds an equation of weight `w`, with `g` the coefficients of its nodes.
  template <int kUnknowns>
  void add(BorderedChain<kUnknowns>& system, const typename BorderedChain<kUnknowns>::Vector& g,
           const PlacedEquation& equation, std::size_t viewer, double w) const {
    add_to_nodes(system, g, equation, equation.value_mm, w);
    const std::size_t i = equation.node;
    const double next = equation.share, here = 1.0 - next;
    const int camera = camera_column(viewer);
    const Eigen::Vector2d at_camera(equation.camera * (1.0 - equation.along), equation.camera * equation.along);
    const bool moved = viewers_[viewer].observation > 0;
    const int place = moved ? place_column(viewers_[viewer].observation) : 0;
    for (int j = 0; j < kUnknowns; ++j) {
      if (g(j) == 0.0) continue;
      for (const auto& [share, node] : {std::pair(here, i), std::pair(next, i + 1)}) {
        auto column = system.border.col(static_cast<Eigen::Index>(node) * kUnknowns + j);
        const double strength = w * share * g(j);
        column.template segment<2>(camera) += strength * at_camera;
        if (moved) column.template segment<6>(place) += strength * equation.place;
      }
    }
    system.border_right.template segment<2>(camera) += w * equation.value_mm * at_camera;
    system.corner.template block<2, 2>(camera, camera) += w * at_camera * at_camera.transpose();
    if (!moved) return;
    system.border_right.template segment<6>(place) += w * equation.value_mm * equation.place;
    system.corner.template block<6, 6>(place, place) += w * equation.place * equation.place.transpose();
    const Eigen::Matrix<double, 6, 2> both = w * equation.place * at_camera.transpose();
    system.corner.template block<6, 2>(place, camera) += both;
    system.corner.template block<2, 6>(camera, place) += both.transpose();
  }

 private:
  template <int kUnknowns>
  static void add_to_nodes(BorderedChain<kUnknowns>& system, const typename BorderedChain<kUnknowns>::Vector& g,
                           const PlacedEquation& equation, double value_mm, double w) {
    const std::size_t i = equation.node;
    const double next = equation.share, here = 1.0 - next;
    const typename BorderedChain<kUnknowns>::Vector by_here = w * here * g, by_next = w * next * g;
    for (int j = 0; j < kUnknowns; ++j) {
      if (g(j) == 0.0) continue;
      const double to_here = here * g(j), to_next = next * g(j);
      system.diagonal[i].col(j) += to_here * by_here;
      system.upper[i].col(j) += to_next * by_here;
      system.diagonal[i + 1].col(j) += to_next * by_next;
    }
    system.right[i] += value_mm * by_here;
    system.right[i + 1] += value_mm * by_next;
  }
  /// Share of an equation's value that the camera's place makes as it was found last.
  [[nodiscard]] double made_by_cameras(const PlacedEquation& equation, std::size_t viewer) const {
    const int camera = camera_column(viewer);
    return equation.camera * ((1.0 - equation.along) * cameras_(camera) + equation.along * cameras_(camera + 1));
  }

  static constexpr int kCameraUnknowns = 2;
  static constexpr int kPlaceUnknowns = 6;
  static int camera_column(std::size_t viewer) { return static_cast<int>(viewer) * kCameraUnknowns; }
  [[nodiscard]] int place_column(std::size_t observation) const {
    return static_cast<int>(viewers_.size()) * kCameraUnknowns + static_cast<int>(observation - 1) * kPlaceUnknowns;
  }

  std::vector<Viewer> viewers_;
  std::vector<Placement> placements_;
  double length_mm_, radius_mm_;
  Vector6d place_sigma_;
  std::vector<Vector6d> place_sum_;  ///< of all moves
  Eigen::VectorXd cameras_;
};

}  // namespace imprint
