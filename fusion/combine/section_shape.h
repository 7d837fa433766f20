#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "fusion/combine/section_prior.h"

namespace imprint {

/// A whole section in the forging's frame: where it stands and its support function (radius and harmonics).
struct SectionShape {
  Eigen::Vector2d axis_mm = Eigen::Vector2d::Zero();
  double radius_mm = 0.0;
  Eigen::Matrix<double, 2 * kHarmonics, 1> harmonics_mm = Eigen::Matrix<double, 2 * kHarmonics, 1>::Zero();

  /// Where the surface's normal points to `theta`, from y towards z.
  [[nodiscard]] Eigen::Vector2d surface(double theta) const {
    double support = radius_mm, turning = 0.0;
    for (int k = kFirstHarmonic; k <= kLastHarmonic; ++k) {
      const double c = std::cos(k * theta), s = std::sin(k * theta);
      const double a = harmonics_mm(2 * (k - kFirstHarmonic)), b = harmonics_mm(2 * (k - kFirstHarmonic) + 1);
      support += a * c + b * s;
      turning += k * (b * c - a * s);
    }
    const Eigen::Vector2d normal(std::cos(theta), std::sin(theta));
    return axis_mm + support * normal + turning * Eigen::Vector2d(-normal.y(), normal.x());
  }
};

/// One a section.
using ForgingShape = std::vector<SectionShape>;

}  // namespace imprint
