#include "fusion/faceted/section_evidence.h"
#include "lib/geometry/median.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

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

PooledSection pooled_section(std::span<const ObservedForging> observations, const JointStart& start) {
  constexpr std::size_t kEvery = 2, kReach = 2;  // tangents are many more than a section needs
  constexpr double kMiddle = 0.15;               // share of the length to either side
  struct Touch {
    Eigen::Vector2d normal;
    double distance;
    std::size_t node;
  };
  std::vector<Touch> touches;
  const std::size_t nodes = start.axis.yz_mm.size();
  std::vector<double> sum(nodes, 0.0), count(nodes, 0.0);
  std::size_t number = 0;
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
        const auto node = static_cast<std::size_t>(std::lround(place));
        for (std::size_t i = node < kReach ? 0 : node - kReach; i <= std::min(node + kReach, nodes - 1); ++i)
          sum[i] += met->distance_mm, count[i] += 1.0;
        // The middle of the forging only, as it may be twisted.
        if (std::abs(place / static_cast<double>(nodes - 1) - 0.5) < kMiddle && number++ % kEvery == 0)
          touches.push_back({met->normal.tail<2>().normalized(), met->distance_mm, node});
      }
    }
  }
  PooledSection pooled;
  double last = 0.0;
  for (std::size_t i = 0; i < nodes && !(last > 0.0); ++i)
    if (count[i] > 0.0) last = sum[i] / count[i];
  for (std::size_t i = 0; i < nodes; ++i) {
    // Where few tangents are, their directions may be one-sided: the neighbours' size goes on.
    if (count[i] > 0.5 * count[nodes / 2]) last = sum[i] / count[i];
    pooled.size_mm.push_back(last);
  }
  for (const Touch& one : touches) pooled.samples.push_back({one.normal, one.distance / pooled.size_mm[one.node]});
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
