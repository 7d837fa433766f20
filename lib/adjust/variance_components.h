#pragma once

#include <map>
#include <vector>

#include <Eigen/Core>

namespace imprint {

/// One target in one image, linearised where the targets stand as the field states: `residual` (observed minus
/// projected) and its derivatives by all that the images share and by the target, in stated standard deviations.
struct LinearSight {
  int target = 0;
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, Eigen::Dynamic> by_shared;
  Eigen::Matrix<double, 2, 3> by_target;  ///< per mm
};

struct VarianceComponents {
  double noise = 1.0;            ///< factor to the stated standard deviations of the centres
  double target_sigma_mm = 0.0;  ///< of each coordinate: what a target is off in all images alike, beyond its own sigma
};

/// How the residuals divide into what changes from image to image and what stays with a target: coordinates not as
/// exact as stated, a dot seen aslant, uneven print or light. A target that is off by the same in every image says less
/// than as many independent observations would. Restricted maximum likelihood, by Förstner's iteration.
/// `stated_sigma_mm`: of each target's coordinates, where the field states it. With too few targets seen in several
/// images the two cannot be told apart, and all is taken for noise.
VarianceComponents find_variance_components(const std::vector<LinearSight>& sights,
                                            const std::map<int, double>& stated_sigma_mm);

}  // namespace imprint
