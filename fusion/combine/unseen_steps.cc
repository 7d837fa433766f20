#include "fusion/combine/unseen_steps.h"

#include <algorithm>
#include <cmath>

namespace imprint {

std::vector<double> unseen_steps(std::span<const ObservedForging> observations, std::span<const double> radius_mm,
                                 double step_mm) {
  const auto last = static_cast<long>(radius_mm.size()) - 1;
  std::vector<char> seen(radius_mm.size(), 0);
  for (const ObservedForging& observed : observations)
    for (const ObservedSection& section : observed.sections)
      for (const TangentPlane& tangent : section.tangents)
        if (!tangent.stray)
          seen[static_cast<std::size_t>(std::clamp(std::lround(tangent.s_mm / step_mm), 0L, last))] = 1;
  constexpr long kShortest = 4;        // nodes of a stretch nobody sees
  constexpr long kBeyond = 4;          // nodes on to where the radius is even again
  constexpr double kNearEnd = 0.4;     // radii beside what is seen, over which it goes on as it is
  constexpr double kHiddenStep = 0.2;  // of the radius, as a standard deviation
  constexpr double kHiddenOver = 1.0;  // radii, over which a step of that size is likely
  std::vector<double> steps(radius_mm.size() - 1, 0.0);
  for (long from = 0; from < last; ++from) {
    long to = from;
    while (to < last && !seen[static_cast<std::size_t>(to + 1)]) ++to;
    const bool at_end = (from == 0 && !seen.front()) || to == last;
    if (to - from >= kShortest && at_end) {
      const double radius = radius_mm[static_cast<std::size_t>(from == 0 ? std::min(to + 1, last) : from)];
      const auto near = std::lround(kNearEnd * radius / step_mm);
      const double step = kHiddenStep * radius * std::sqrt(step_mm / (kHiddenOver * radius));
      const long begin = from == 0 ? 0 : from + near;
      const long end = from == 0 ? to - near : last;
      for (long i = begin; i < end; ++i) steps[static_cast<std::size_t>(i)] = step;
    } else if (to - from >= kShortest) {
      const double step = radius_mm[static_cast<std::size_t>(std::min(to + kBeyond, last))] -
                          radius_mm[static_cast<std::size_t>(std::max(from - kBeyond, 0L))];
      for (long i = from; i <= std::min(to, last - 1); ++i) steps[static_cast<std::size_t>(i)] = step;
    }
    from = to;
  }
  return steps;
}

}  // namespace imprint
