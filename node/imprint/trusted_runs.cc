#include "node/imprint/trusted_runs.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace imprint {
namespace {

using Runs = std::vector<SampleRange>;

Runs trusted_runs(const RimCurve& curve) {
  Runs runs;
  for (std::size_t begin = 0; begin < curve.size();) {
    std::size_t end = begin;
    while (end < curve.size() && curve[end].weight > 0) ++end;
    if (end > begin) runs.push_back({begin, end});
    begin = std::max(end, begin + 1);
  }
  return runs;
}

void distrust(RimCurve& curve, double from_px, double to_px) {
  for (CurveSample& s : curve)
    if (s.station_px >= from_px && s.station_px <= to_px) s.weight = 0.0;
}

double mean_offset_px(const RimCurve& curve, SampleRange run) {
  double sum = 0.0;
  for (std::size_t i = run.first; i < run.last; ++i) sum += curve[i].offset_px;
  return sum / static_cast<double>(run.last - run.first);
}

}  // namespace

void drop_short_runs(RimCurve& curve, std::size_t least_run) {
  for (const SampleRange run : trusted_runs(curve))
    for (std::size_t i = run.first; i < run.last && run.last - run.first < least_run; ++i) curve[i].weight = 0.0;
}

void drop_islands(RimCurve& filtered, double inward, RimCurve& rim) {
  constexpr double kShort = 0.04, kDeep = 0.003;  // of the rim's length
  constexpr double kAlone = 1.0;                  // of the stretch's own length, to the next on either side
  constexpr double kShoulder = 2.0;               // px per station, to the next: steeper, it does not go on there
  constexpr double kLean = 0.1;                   // px per station
  const auto all = static_cast<double>(filtered.size());
  const auto go_on = [&](std::size_t from, std::size_t to,
                         double length) {  // from one stretch's last to another's first
    const double gap = filtered[to].station_px - filtered[from].station_px;
    return gap <= kAlone * length && std::abs(filtered[to].offset_px - filtered[from].offset_px) <= kShoulder * gap;
  };
  Runs runs = trusted_runs(filtered);
  for (std::size_t i = 0; i < runs.size();) {
    const auto [first, end] = runs[i];
    const auto length = static_cast<double>(end - first);
    const bool has_before = i > 0, has_after = i + 1 < runs.size();
    const std::size_t before = has_before ? runs[i - 1].last - 1 : first,
                      after = has_after ? runs[i + 1].first : end - 1;
    const bool alone = length <= kShort * all && !(has_before && go_on(before, first, length)) &&
                       !(has_after && go_on(end - 1, after, length));
    const bool leans = std::abs(filtered[end - 1].offset_px - filtered[first].offset_px) > kLean * length;
    const auto depth = [&](std::size_t other) {
      return inward * (mean_offset_px(filtered, runs[i]) - filtered[other].offset_px);
    };
    const bool deep = has_before && has_after && std::min(depth(before), depth(after)) > kDeep * all;
    if (!alone || !(leans || deep)) {
      ++i;
      continue;
    }
    const double from = filtered[first].station_px, to = filtered[end - 1].station_px;
    distrust(filtered, from, to), distrust(rim, from, to);
    runs.erase(runs.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

}  // namespace imprint
