#pragma once

#include "lib/geometry/points.h"
#include "simulation/layout.h"
#include "simulation/scene.h"
#include "simulation/texture.h"

namespace imprint {

/// How hot air moves what one camera sees in one frame: a smooth random displacement. Its size is haze_rms_px at the
/// forging, more in the plume above it and less far away. The truth leaves it out.
class Haze {
 public:
  Haze(const Scene& scene, const Layout& layout, int observation, int camera);

  /// Displacement in px of what would be seen at `p` without haze.
  [[nodiscard]] ObservedPoint at(const ObservedPoint& p) const;

 private:
  double rms_px_;
  double plume_px_;            // height over which the plume fades
  ObservedPoint start_, end_;  // image of the forging's axis
  SmoothField coarse_x_, coarse_y_, fine_x_, fine_y_;
};

}  // namespace imprint
