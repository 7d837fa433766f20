#include "node/segment/directions.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "node/segment/axis_lines.h"
#include "node/segment/body_search.h"
#include "node/segment/rim_candidates.h"

namespace imprint {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kApart = 4.0 * kDegree;  // directions nearer than this are one

// What lies along one direction, each with the direction it really has.
void look_along(const ReducedImage& reduced, double angle, const SegmentPrior& prior, const SegmentConfig& config,
                std::vector<Direction>& seen) {
  const WorkingImage working = turn_image(reduced, std::cos(angle), std::sin(angle));
  const double r = working.reduction;
  const RimPairs pairs =
      pair_rims(working, find_rim_candidates(working, config), prior.diameter_min_px / r, prior.diameter_max_px / r);
  for (const FoundBody& body : glimpse_bodies(pairs, working, prior, config)) {
    const double turned = angle + std::atan(body.axis.slope);
    seen.push_back({std::cos(turned), std::sin(turned), body.rating});
  }
}

}  // namespace

std::vector<Direction> likely_directions(const ReducedImage& reduced, const SegmentPrior& prior,
                                         const SegmentConfig& config) {
  const bool large = prior.diameter_min_px / reduced.reduction >= config.min_reduced_diameter_px;
  const ReducedImage image = large ? halve(reduced) : reduced;
  SegmentConfig quick = config;
  quick.min_rim_run_px = std::max(1, config.min_rim_run_px / 2);
  quick.axis_candidates = std::max(1, config.axis_candidates / 3);
  const int steps = static_cast<int>(std::ceil(config.max_tilt_deg / config.turn_step_deg - 0.5));
  quick.max_tilt_deg = std::min(config.max_tilt_deg, 0.6 * config.turn_step_deg);

  const double along = std::atan2(prior.direction_y, prior.direction_x);
  std::vector<Direction> seen;
  for (int k = -steps; k <= steps; ++k)
    look_along(image, along + k * config.turn_step_deg * kDegree, prior, quick, seen);
  std::sort(seen.begin(), seen.end(), [](const Direction& a, const Direction& b) { return a.rating > b.rating; });
  std::vector<Direction> kept;
  for (const Direction& d : seen) {
    if (static_cast<int>(kept.size()) == config.directions_followed) break;
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const Direction& k) {
      return std::abs(std::remainder(std::atan2(d.y, d.x) - std::atan2(k.y, k.x), 2 * std::numbers::pi)) < kApart;
    });
    if (!known) kept.push_back(d);
  }
  return kept;
}

}  // namespace imprint
