#include "node/pose/hot_air.h"

#include <algorithm>
#include <cmath>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

// The silhouette as a straight band.
struct Band {
  double first_px = 0.0, last_px = 0.0;  // stations
  double middle_px = 0.0, half_width_px = 0.0;
};

Band band_of(const Segmentation& forging) {
  std::vector<double> widths, middles;
  for (std::size_t i = 0; i < std::min(forging.upper_offset_px.size(), forging.lower_offset_px.size()); ++i) {
    const double upper = forging.upper_offset_px[i], lower = forging.lower_offset_px[i];
    if (!std::isfinite(upper) || !std::isfinite(lower)) continue;
    widths.push_back(lower - upper);
    middles.push_back(0.5 * (lower + upper));
  }
  if (widths.empty()) return {};
  return {static_cast<double>(forging.first_station_px),
          forging.first_station_px + static_cast<double>(forging.upper_offset_px.size()) - 1.0, median(middles),
          0.5 * median(widths)};
}

double distance_px(const Segmentation& forging, const Band& band, const ObservedPoint& p) {
  const double x = p.x_px - forging.origin.x_px, y = p.y_px - forging.origin.y_px;
  const double along = x * forging.direction_x + y * forging.direction_y;
  const double across = -x * forging.direction_y + y * forging.direction_x;
  const double beyond = std::max({band.first_px - along, along - band.last_px, 0.0});
  const double beside = std::max(std::abs(across - band.middle_px) - band.half_width_px, 0.0);
  return std::hypot(beyond, beside);
}

}  // namespace

Result<void> HotAirConfig::validate() const {
  if (!(sigma_px >= 0.0) || !(reach_diameters > 0.0))
    return invalid_input("hot_air: sigma_px of at least 0 and reach_diameters above 0 expected, found {} and {}",
                         sigma_px, reach_diameters);
  return {};
}

std::vector<DetectedTarget> weigh_hot_air(std::vector<DetectedTarget> targets, const Segmentation& forging,
                                          const HotAirConfig& config) {
  const Band band = band_of(forging);
  if (!(band.half_width_px > 0.0)) return targets;
  const double reach_px = config.reach_diameters * 2.0 * band.half_width_px;
  for (DetectedTarget& target : targets) {
    const double air_px = config.sigma_px * std::exp(-distance_px(forging, band, target.center) / reach_px);
    target.sigma_px = std::hypot(target.sigma_px, air_px);
  }
  return targets;
}

}  // namespace imprint
