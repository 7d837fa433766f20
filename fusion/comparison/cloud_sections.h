#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace imprint {

/// A cross-section of a point cloud: the circle through its points and how far they are from round.
struct CloudSection {
  double x_mm = 0.0;
  Eigen::Vector2d center_mm = Eigen::Vector2d::Zero();  ///< y, z
  double diameter_mm = 0.0;
  double circularity_mm = 0.0;  ///< (largest - smallest width) / 2, of harmonics 2 to 6
  double axis_ci95_mm = 0.0, diameter_ci95_mm = 0.0, circularity_ci95_mm = 0.0;
  int points = 0;
};

/// Points of a cloud sorted along x, to be cut into slices square to x.
class SortedCloud {
 public:
  explicit SortedCloud(std::vector<Eigen::Vector3d> points_mm);

  /// The circle with harmonics 2 to 6 through the points within half of `width_mm` of x, without those more than
  /// three sigma off ([D] 2.2.2). Nothing where they are too few, or stand on less than two thirds of the turn.
  [[nodiscard]] std::optional<CloudSection> cut(double x_mm, double width_mm) const;

  [[nodiscard]] double first_mm() const { return points_.front().x(); }
  [[nodiscard]] double last_mm() const { return points_.back().x(); }

 private:
  std::vector<Eigen::Vector3d> points_;
};

}  // namespace imprint
