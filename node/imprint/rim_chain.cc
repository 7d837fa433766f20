#include "node/imprint/rim_chain.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

constexpr double kReachPx = 24;  // of a stretch's ends, for its course beyond them

// A piece of the rim without steps, and where it is heading at both of its ends.
struct Stretch {
  std::size_t first = 0, last = 0;  // samples [first, last)
  double from = 0, to = 0;          // stations
  double worth = 0;                 // sum of the weights
  LocalParabola head, tail;         // lines at its first and last station
};

std::vector<Stretch> cut_into_stretches(const RimCurve& rim, const std::vector<double>& cuts) {
  std::vector<Stretch> stretches;
  std::size_t begin = 0;
  auto cut = cuts.begin();
  for (std::size_t i = 1; i <= rim.size(); ++i) {
    while (cut != cuts.end() && *cut < rim[i - 1].station_px) ++cut;
    const bool ends = i == rim.size() || (cut != cuts.end() && *cut < rim[i].station_px);
    if (!ends) continue;
    Stretch s{begin, i, rim[begin].station_px, rim[i - 1].station_px, 0, {}, {}};
    for (std::size_t k = begin; k < i; ++k) s.worth += rim[k].weight;
    const SampleRange head = samples_near(rim, s.from + 0.5 * kReachPx, 0.5 * kReachPx),
                      tail = samples_near(rim, s.to - 0.5 * kReachPx, 0.5 * kReachPx);
    const CurveSample* data = rim.data();
    const auto at_head = fit_parabola(data + begin, data + std::min(i, head.last), s.from, 1);
    const auto at_tail = fit_parabola(data + std::max(begin, tail.first), data + i, s.to, 1);
    begin = i;
    if (!at_head || !at_tail || s.last - s.first < 4) continue;
    s.head = *at_head, s.tail = *at_tail;
    // A forging's rim runs along its axis: what runs askew is a shoulder or the border of scale.
    const double slope = (s.tail.c0 - s.head.c0) / std::max(1.0, s.to - s.from);
    s.worth *= std::clamp((0.3 - std::abs(slope)) / 0.2, 0.0, 1.0);
    stretches.push_back(s);
  }
  return stretches;
}

// How far a rim steps between two stations: its line after them less its line before them, in the middle. Nothing when
// it was not seen on both sides.
std::optional<double> step_between(const RimCurve& rim, double from, double to) {
  const SampleRange before = samples_near(rim, from - 0.5 * kReachPx, 0.5 * kReachPx);
  const SampleRange after = samples_near(rim, to + 0.5 * kReachPx, 0.5 * kReachPx);
  if (before.last - before.first < 6 || after.last - after.first < 6) return std::nullopt;
  const double middle = 0.5 * (from + to);
  const auto left = fit_parabola(rim.data() + before.first, rim.data() + before.last, from, 1);
  const auto right = fit_parabola(rim.data() + after.first, rim.data() + after.last, to, 1);
  if (!left || !right) return std::nullopt;
  return right->at(middle) - left->at(middle);
}

// How far b lies off a's course, px: the mean of looking ahead from a and back from b. A short stretch's slope is
// poorly known, so it is not carried further than the stretch is long.
double mismatch_px(const Stretch& a, const Stretch& b) {
  const auto ahead = [](const LocalParabola& line, double from, double to, double length) {
    const double reach = std::clamp(to - from, -length, length);
    return line.c0 + line.c1 * reach;
  };
  const double forward = b.head.c0 - ahead(a.tail, a.to, b.from, a.to - a.from);
  const double backward = ahead(b.head, b.from, a.to, b.to - b.from) - a.tail.c0;
  return std::abs(forward) < std::abs(backward) ? forward : backward;
}

}  // namespace

void keep_likeliest_course(RimCurve& rim, const std::vector<double>& cuts, const RimCurve& other, double noise_px,
                           double diameter_px, const FilterConfig& config) {
  const std::vector<Stretch> stretches = cut_into_stretches(rim, cuts);
  if (stretches.empty()) return;
  const double price = std::max(60.0, config.lone_step_price * diameter_px);
  const double free_px = std::max(0.3, 4 * noise_px);
  // What noise and haze make of the slope of a stretch's end.
  const auto slope_tolerance = [&](const Stretch& s) {
    const double n = std::min(kReachPx, static_cast<double>(s.last - s.first));
    return 0.05 + 3 * std::max(noise_px, 0.05) * std::sqrt(12 / (n * n * n));
  };
  const auto cost = [&](const Stretch& a, const Stretch& b) {
    const double gap = b.from - a.to;
    const double off = mismatch_px(a, b);
    const double excess = std::max(0.0, std::abs(off) - free_px - 0.01 * gap);
    const double turn = std::max(0.0, std::abs(b.head.c1 - a.tail.c1) - slope_tolerance(a) - slope_tolerance(b));
    double step = price * std::min(1.0, excess / 1.5 + turn / 0.3);
    if (step > 0 && std::abs(off) > config.min_shared_step_px) {
      // Shared with the other rim: it moves in or out by about as much over the same gap.
      const auto shared = step_between(other, a.to, b.from);
      if (shared && -*shared * off > 0.5 * off * off && -*shared * off < 2 * off * off) step *= 0.15;
    }
    return step;
  };

  std::vector<double> gain(stretches.size());
  std::vector<std::ptrdiff_t> from(stretches.size(), -1);
  for (std::size_t b = 0; b < stretches.size(); ++b) {
    double inherited = 0;
    for (std::size_t a = b; a-- > 0;) {
      if (stretches[b].from - stretches[a].to > config.max_chain_gap) break;
      if (const double g = gain[a] - cost(stretches[a], stretches[b]); g > inherited)
        inherited = g, from[b] = static_cast<std::ptrdiff_t>(a);
    }
    gain[b] = stretches[b].worth + inherited;
  }
  std::vector<char> keep(rim.size(), 0);
  for (auto b = std::max_element(gain.begin(), gain.end()) - gain.begin(); b >= 0;
       b = from[static_cast<std::size_t>(b)]) {
    const Stretch& s = stretches[static_cast<std::size_t>(b)];
    std::fill(keep.begin() + static_cast<std::ptrdiff_t>(s.first), keep.begin() + static_cast<std::ptrdiff_t>(s.last),
              1);
  }
  for (std::size_t i = 0; i < rim.size(); ++i)
    if (!keep[i]) rim[i].weight = 0.0;
}

}  // namespace imprint
