#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

namespace imprint {

/// An ellipse in px: the points with (x - center)' shape (x - center) = 1; `shape` is symmetric, positive definite.
struct Ellipse {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();

  [[nodiscard]] static Ellipse circle(const Eigen::Vector2d& center, double radius) {
    return {center, Eigen::Matrix2d::Identity() / (radius * radius)};
  }
  /// The same ellipse where one px is `scale` px long.
  [[nodiscard]] Ellipse scaled(double scale, const Eigen::Vector2d& new_center) const {
    return {new_center, shape / (scale * scale)};
  }
  /// Distance from the centre in units of the ellipse: 1 on it.
  [[nodiscard]] double radius_of(const Eigen::Vector2d& point) const {
    const Eigen::Vector2d d = point - center;
    return std::sqrt(d.dot(shape * d));
  }
};

struct EllipseAxes {
  double semi_major_px = 0.0;
  double semi_minor_px = 0.0;
};

EllipseAxes axes_of(const Ellipse& ellipse);

/// Mean of the two axes.
double mean_diameter(const Ellipse& ellipse);

/// The symmetric matrix that maps the unit circle to the ellipse about its centre. It does not mirror, so that angles
/// in the circle run the way they run in the image (clockwise as seen, y being down).
Eigen::Matrix2d frame_of(const Ellipse& ellipse);

/// The conic through `points` of least algebraic residual, points given in the frame of `guess` (where it is the unit
/// circle), each with a weight; the result is in px. Nothing when it is no ellipse.
std::optional<Ellipse> fit_ellipse(std::span<const Eigen::Vector2d> points, std::span<const double> weights,
                                   const Ellipse& guess);

}  // namespace imprint
