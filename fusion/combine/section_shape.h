#pragma once

#include <vector>

#include <Eigen/Core>

#include "fusion/combine/section_prior.h"

namespace imprint {

/// A whole section in the forging's frame: where it stands and its support function, radius plus for every harmonic k
/// a cos(k theta) + b sin(k theta), theta being the direction of the surface's normal from y towards z.
struct SectionShape {
  Eigen::Vector2d axis_mm = Eigen::Vector2d::Zero();
  double radius_mm = 0.0;
  Eigen::Matrix<double, 2 * kHarmonics, 1> harmonics_mm = Eigen::Matrix<double, 2 * kHarmonics, 1>::Zero();
};

/// One a section.
using ForgingShape = std::vector<SectionShape>;

}  // namespace imprint
