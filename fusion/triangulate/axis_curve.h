#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace imprint {

/// A bent axis as a curve over a straight line: at x along the line it stands y and z beside it.
/// Sampled at equal steps of x and taken straight between samples and beyond them.
struct AxisCurve {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_line = Eigen::Matrix3d::Identity();  ///< rows: the line's direction, y, z
  double x_first_mm = 0.0;
  double x_step_mm = 1.0;
  std::vector<Eigen::Vector2d> yz_mm;  ///< one a sample
  std::vector<Eigen::Vector2d> slope;  ///< d(y, z)/dx, one a sample

  struct Place {
    Eigen::Vector3d point_mm;   ///< on the axis
    Eigen::Vector3d direction;  ///< of the axis there, length 1
  };
  [[nodiscard]] Place at(double x_mm) const;
  [[nodiscard]] double x_of(const Eigen::Vector3d& point_mm) const { return R_line.row(0).dot(point_mm - origin_mm); }
  /// Fills `slope` by central differences of `yz_mm`.
  void set_slopes();
};

/// A straight axis through `origin_mm`.
AxisCurve straight_axis(const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction, double x_first_mm,
                        double x_last_mm, int samples);

/// `axis` with as many samples, over [low_mm, high_mm] of its line.
AxisCurve over(const AxisCurve& axis, double low_mm, double high_mm);

/// Where a viewing ray touches a bar around `axis`, and the viewing plane there.
struct RimContact {
  double x_mm = 0.0;         ///< along the axis curve's line
  Eigen::Vector3d normal;    ///< of the viewing plane, length 1, out of the bar
  double offset_mm = 0.0;    ///< normal . X on the plane
  double distance_mm = 0.0;  ///< of the plane from the axis point at x
  double range_mm = 0.0;     ///< from the camera
};

/// The viewing plane holds the ray and the axis direction at the contact: exact where the bar is a cylinder,
/// and calmer than the rim's own slope where it is not. Nothing when the ray runs along the axis, meets it,
/// or touches behind the camera.
std::optional<RimContact> touch(const AxisCurve& axis, const Eigen::Vector3d& center_mm, const Eigen::Vector3d& ray,
                                double x_guess_mm);

/// Where along the axis the end circle lies, when `ray` meets its outline at the outermost point.
/// A camera that stands on the bar's side of the end plane sees the near arc outermost, one beyond the end
/// the far arc. `last`: the end with the larger x. Nothing when the ray passes beside the circle.
std::optional<Eigen::Vector3d> meet_end_circle(const AxisCurve& axis, const Eigen::Vector3d& center_mm,
                                               const Eigen::Vector3d& ray, double radius_mm, bool last,
                                               double x_guess_mm);

}  // namespace imprint
