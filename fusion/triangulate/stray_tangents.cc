#include "fusion/triangulate/stray_tangents.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace imprint {
namespace {

constexpr int kNeighbours = 12;     // sections on either side: a shoulder leaves one side as it is
constexpr std::size_t kFewest = 6;  // tangents that make a median

double distance_mm(const ObservedSection& section, const TangentPlane& tangent) {
  return tangent.offset_mm - tangent.normal_world.dot(section.axis_world_mm);
}

std::optional<double> median_distance_mm(const std::vector<ObservedSection>& sections, int from, int to) {
  std::vector<double> distances;
  for (int i = std::max(0, from); i <= std::min(to, static_cast<int>(sections.size()) - 1); ++i) {
    const ObservedSection& section = sections[static_cast<std::size_t>(i)];
    for (const TangentPlane& tangent : section.tangents) distances.push_back(distance_mm(section, tangent));
  }
  if (distances.size() < kFewest) return std::nullopt;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

}  // namespace

int remove_stray_tangents(std::vector<ObservedSection>& sections, double radius_mm, double tolerance_share) {
  const double tolerance_mm = tolerance_share * radius_mm;
  std::vector<std::vector<TangentPlane>> kept(sections.size());
  int removed = 0;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const int here = static_cast<int>(i);
    const auto before = median_distance_mm(sections, here - kNeighbours, here + 1);
    const auto after = median_distance_mm(sections, here - 1, here + kNeighbours);
    // Between the two sides counts as like them: a shoulder has every radius from one to the other.
    const auto usual = before ? before : after;
    const double least = usual ? std::min(*usual, after.value_or(*usual)) : 0.0;
    const double most = usual ? std::max(*usual, after.value_or(*usual)) : 0.0;
    for (const TangentPlane& tangent : sections[i].tangents) {
      const double distance = distance_mm(sections[i], tangent);
      const bool stays = !usual || (distance > least - tolerance_mm && distance < most + tolerance_mm);
      if (stays) kept[i].push_back(tangent);
      removed += stays ? 0 : 1;
    }
  }
  for (std::size_t i = 0; i < sections.size(); ++i) sections[i].tangents = std::move(kept[i]);
  return removed;
}

}  // namespace imprint
