#include "node/imprint/trusted_rims.h"

#include <cmath>

namespace imprint {
namespace {

std::vector<EdgePoint> trusted(const std::vector<EdgePoint>& points, const std::vector<FilteredPoint>& curve) {
  constexpr double kLeastWeight = 0.3, kNearPx = 1.5;
  std::vector<EdgePoint> out;
  std::size_t k = 0;
  for (const EdgePoint& p : points) {
    while (k < curve.size() && curve[k].station_px < p.station_px - 0.5) ++k;
    if (k == curve.size()) break;
    const FilteredPoint& at = curve[k];
    if (std::abs(at.station_px - p.station_px) <= 0.5 && at.weight >= kLeastWeight &&
        std::abs(at.offset_px - p.offset_px) <= kNearPx)
      out.push_back(p);
  }
  return out;
}

}  // namespace

Silhouette trusted_rims(const Silhouette& silhouette, const FilteredSilhouette& filtered) {
  Silhouette out = silhouette;
  out.upper = trusted(silhouette.upper, filtered.upper);
  out.lower = trusted(silhouette.lower, filtered.lower);
  return out;
}

}  // namespace imprint
