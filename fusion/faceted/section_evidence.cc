#include "fusion/faceted/section_evidence.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

/// How many times as wide as in `first` the forging is in `later`, in the median of the stations that show both rims in
/// both: where scale hides now the thin, now the thick part, the widths themselves would differ. 1 where too few do.
double width_ratio(const Imprint& first, const Imprint& later) {
  std::vector<double> ratios;
  const std::size_t n = std::min({first.upper.offset_px.size(), first.lower.offset_px.size(),
                                  later.upper.offset_px.size(), later.lower.offset_px.size()});
  const auto width = [](const Imprint& imprint, std::size_t i) {
    const bool seen = imprint.upper.weight[i] > 0.0 && imprint.lower.weight[i] > 0.0;
    return seen ? std::abs(imprint.lower.offset_px[i] - imprint.upper.offset_px[i]) : 0.0;
  };
  for (std::size_t i = 0; i < n; ++i)
    if (width(first, i) > 0.0 && width(later, i) > 0.0) ratios.push_back(width(later, i) / width(first, i));
  return ratios.size() < n / 4 || ratios.empty() ? 1.0 : median(ratios);
}

int corners_of(SectionKind kind) {
  if (kind == SectionKind::square || kind == SectionKind::rectangle) return 4;
  return kind == SectionKind::octagon ? 8 : 12;
}

}  // namespace

double change_of_width(std::span<const std::vector<Imprint>> observations) {
  std::map<std::string, std::vector<const Imprint*>> by_camera;
  for (const std::vector<Imprint>& imprints : observations)
    for (const Imprint& imprint : imprints)
      if (imprint.failure.empty()) by_camera[imprint.camera_id].push_back(&imprint);
  // One camera may have followed something else in one observation: the second largest change counts.
  std::vector<double> changes;
  for (const auto& [camera, seen] : by_camera) {
    double least = 1.0, largest = 1.0;
    for (const Imprint* later : seen) {
      const double ratio = width_ratio(*seen.front(), *later);
      least = std::min(least, ratio), largest = std::max(largest, ratio);
    }
    changes.push_back(largest / least - 1.0);
  }
  if (changes.size() < 2) return 0.0;
  std::sort(changes.rbegin(), changes.rend());
  return changes[1];
}

namespace {

/// A tangent where it touches the start's rod.
struct Touch {
  Eigen::Vector2d normal;
  double distance_mm;
  std::size_t node, rim;
};

/// Size of the section at each node, of the shape that the rims show together: what a rim has more than others counts
/// for the shape, what it gains along the forging for the size. Which rims scale hides then does not matter.
std::vector<double> sizes_along(std::span<const Touch> touches, std::size_t nodes, std::size_t rims) {
  constexpr std::size_t kReach = 2;
  constexpr int kRounds = 4;
  std::vector<double> size(nodes, 1.0), level(rims);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> sum(rims, 0.0), count(rims, 0.0);
    for (const Touch& one : touches) sum[one.rim] += one.distance_mm / size[one.node], count[one.rim] += 1.0;
    double mean = 0.0;  // of all rims alike, as the shape's own size is 1
    for (std::size_t r = 0; r < rims; ++r) {
      level[r] = count[r] > 0.0 ? sum[r] / count[r] : 0.0;
      mean +=
          level[r] / static_cast<double>(std::count_if(count.begin(), count.end(), [](double n) { return n > 0.0; }));
    }
    sum.assign(nodes, 0.0), count.assign(nodes, 0.0);
    for (const Touch& one : touches)
      for (std::size_t i = one.node < kReach ? 0 : one.node - kReach; i <= std::min(one.node + kReach, nodes - 1); ++i)
        sum[i] += one.distance_mm * mean / level[one.rim], count[i] += 1.0;
    double last = 0.0;
    for (std::size_t i = 0; i < nodes && !(last > 0.0); ++i)
      if (count[i] > 0.0) last = sum[i] / count[i];
    for (std::size_t i = 0; i < nodes; ++i) size[i] = last = count[i] > 0.0 ? sum[i] / count[i] : last;
  }
  return size;
}

}  // namespace

PooledSection pooled_section(std::span<const ObservedForging> observations, const JointStart& start) {
  constexpr std::size_t kEvery = 2;  // tangents are many more than a section needs
  constexpr double kMiddle = 0.15;   // share of the length to either side
  std::vector<Touch> touches;
  const std::size_t nodes = start.axis.yz_mm.size();
  std::map<std::tuple<std::size_t, int, bool>, std::size_t> rims;  // by observation, camera and side
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Placement& placement = start.placements[k];
    for (const ObservedSection& section : observations[k].sections) {
      for (const TangentPlane& tangent : section.tangents) {
        const CameraShare& share = observations[k].cameras[static_cast<std::size_t>(tangent.camera)];
        const auto met = touch(start.axis, placement.point(share.pose.center_world_mm), placement.R * tangent.ray_world,
                               tangent.s_mm);
        if (!met || tangent.weight <= 0.0) continue;
        const double place = met->x_mm / start.axis.x_step_mm;
        if (!(place >= 0.0) || place > static_cast<double>(nodes - 1)) continue;
        const std::size_t rim = rims.try_emplace({k, tangent.camera, tangent.upper}, rims.size()).first->second;
        touches.push_back(
            {met->normal.tail<2>().normalized(), met->distance_mm, static_cast<std::size_t>(std::lround(place)), rim});
      }
    }
  }
  PooledSection pooled{.size_mm = sizes_along(touches, nodes, rims.size()), .samples = {}};
  std::size_t number = 0;
  for (const Touch& one : touches) {
    // The middle of the forging only, as it may be twisted.
    const double place = static_cast<double>(one.node) / static_cast<double>(nodes - 1);
    if (std::abs(place - 0.5) < kMiddle && number++ % kEvery == 0)
      pooled.samples.push_back({one.normal, one.distance_mm / pooled.size_mm[one.node]});
  }
  return pooled;
}

FoundSection find_section(std::span<const SupportSample> samples, SectionKind told) {
  constexpr double kThanRound = 0.5, kThanFewer = 0.25;  // share of the scatter that more corners may leave at most
  constexpr double kAlike = 0.02;                        // widths of a square
  constexpr double kLeast = 5e-4;                        // scatter, of the size, that tells nothing more
  constexpr double kRoundest = 0.7;                      // corner radius, of the size, beyond which no face is left
  FoundSection found;
  if (told == SectionKind::round || samples.size() < 100) return found;
  if (told != SectionKind::unknown) {
    found.kind = told;
    found.fit = fit_corners(samples, corners_of(told), told == SectionKind::square || told == SectionKind::octagon);
    return found;
  }
  double least = std::max(kLeast, harmonic_scatter(samples));
  for (const SectionKind kind : {SectionKind::rectangle, SectionKind::octagon, SectionKind::convex}) {
    CornerFit fit = fit_corners(samples, corners_of(kind));
    const double allowed = found.kind == SectionKind::round ? kThanRound : kThanFewer;
    if (!(std::max(kLeast, fit.scatter) < allowed * least) || fit.section.radius_mm > kRoundest) continue;
    least = std::max(kLeast, fit.scatter);
    found.kind = kind;
    found.fit = std::move(fit);
  }
  if (found.kind == SectionKind::rectangle) {
    const Eigen::VectorXd measures = measures_of(found.fit.section, found.kind);
    if (std::abs(measures(kWidths) / measures(kWidths + 1) - 1.0) < kAlike) found.kind = SectionKind::square;
  }
  return found;
}

}  // namespace imprint
