#pragma once

#include "fusion/combine/section_prior.h"

namespace imprint {

/// (largest - smallest width) / 2 over all directions, [D] 2.1.3, of a section known with some uncertainty.
struct Circularity {
  double value_mm = 0.0;  ///< its mean over what the section may be
  double sigma_mm = 0.0;
};

/// Only the even harmonics change a width. The largest and the smallest width are extremes, which an average section
/// understates, so the mean is taken over sections drawn from the estimate's covariance (always the same draws).
Circularity circularity(const NodeVector& node, const NodeMatrix& covariance);

}  // namespace imprint
