#include "node/edge/rim_haze.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// One a station from the first edge point's on; NaN where there is none.
std::vector<double> offsets_of(const std::vector<EdgePoint>& points) {
  if (points.empty()) return {};
  std::vector<double> offsets(static_cast<std::size_t>(points.back().station_px - points.front().station_px) + 1,
                              kUnknown);
  for (const EdgePoint& p : points)
    offsets[static_cast<std::size_t>(p.station_px - points.front().station_px)] = p.offset_px;
  return offsets;
}

// Distances of points from the chord between those `arm` stations on either side.
void add_distances(const std::vector<double>& offsets, std::size_t arm, std::vector<double>& out) {
  for (std::size_t i = arm; i + arm < offsets.size(); ++i) {
    const double distance = offsets[i] - 0.5 * (offsets[i - arm] + offsets[i + arm]);
    if (!std::isnan(distance)) out.push_back(std::abs(distance));
  }
}

// Mean square of distances that are normal but for a part that is far out: shoulders, and scale that moves edges.
double robust_variance(const std::vector<double>& distances) {
  constexpr double kReach = 2.5, kVarianceWithin = 0.911;  // of a normal distribution cut there
  double sigma = 1.4826 * median(distances);
  for (int pass = 0; pass < 8; ++pass) {
    double squares = 0.0, count = 0.0;
    for (const double d : distances)
      if (d <= kReach * sigma) squares += d * d, count += 1.0;
    if (count == 0.0) break;
    sigma = std::sqrt(squares / count / kVarianceWithin);
  }
  return sigma * sigma;
}

}  // namespace

double rim_haze_px(const Silhouette& silhouette) {
  constexpr double kArmShare = 0.2;     // of the diameter
  constexpr std::size_t kNoiseArm = 3;  // stations: nearer ones can share image columns, and their noise
  constexpr std::size_t kLeastCount = 50;
  std::vector<double> widths;
  const Segmentation& frame = silhouette.frame;
  for (std::size_t i = 0; i < frame.upper_offset_px.size(); ++i)
    if (const double width = frame.lower_offset_px[i] - frame.upper_offset_px[i]; !std::isnan(width))
      widths.push_back(width);
  if (widths.empty()) return 0.0;
  const auto arm =
      static_cast<std::size_t>(std::lround(std::max(2.0 * kNoiseArm, kArmShare * median(std::move(widths)))));
  std::vector<double> far, near;
  for (const auto* rim : {&silhouette.upper, &silhouette.lower}) {
    const std::vector<double> offsets = offsets_of(*rim);
    add_distances(offsets, arm, far);
    add_distances(offsets, kNoiseArm, near);
  }
  if (far.size() < kLeastCount || near.size() < kLeastCount) return 0.0;
  return std::sqrt(std::max(0.0, robust_variance(far) - robust_variance(near)));
}

}  // namespace imprint
