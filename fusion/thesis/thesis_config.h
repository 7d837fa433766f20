#pragma once

#include "lib/result/result.h"

namespace imprint {

/// How the thesis's estimators are run.
struct ThesisConfig {
  int sections = 500;                    ///< points of a curve, [D] 2.1.3
  int axis_window = 41;                  ///< sections of the Savitzky-Golay filter of an axis; 40 in [D] 2.1.2
  int silhouette_window = 11;            ///< the same of a silhouette; 10 in [D] 2.1.2
  double max_ray_distance_share = 0.25;  ///< of the largest diameter: limit on [D] equation 2, as TriangulateConfig

  [[nodiscard]] Result<void> validate() const;
};

}  // namespace imprint
