#include "node/detect/found_targets.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

void note(DetectionTrace* trace, const FoundTarget& found, Rejection reason) {
  if (trace != nullptr) trace->rejected.push_back({found.ellipse, reason});
}

bool is_clearly_better(const FoundTarget& a, const FoundTarget& b) {
  constexpr double larger = 2.0;  // what texture feigns is small
  return a.target.distance + 0.5 <= b.target.distance || a.target.dot_diameter_px >= larger * b.target.dot_diameter_px;
}

bool is_better(const FoundTarget& a, const FoundTarget& b) {
  if (a.target.distance != b.target.distance) return a.target.distance < b.target.distance;
  return a.fit / a.target.dot_diameter_px < b.fit / b.target.dot_diameter_px;
}

void drop_unlikely(std::vector<FoundTarget>& found, const UnreadRings& unread, DetectionTrace* trace) {
  constexpr double expected_to_target = 10.0;
  constexpr double few_targets = 5.0;
  const double odds = unread.all / (expected_to_target * (static_cast<double>(found.size()) + few_targets));
  const double least_lead = std::log(std::max(1.0, odds));
  constexpr double all_unread = 2.0;  // nats
  const double lead_of_covered =
      all_unread * unread.like_codes / std::max(1.0, static_cast<double>(found.size()) + unread.like_codes);
  std::erase_if(found, [&](const FoundTarget& f) {
    if (f.lead >= least_lead + (f.covered ? lead_of_covered : 0.0)) return false;
    note(trace, f, Rejection::no_code);
    return true;
  });
}

}  // namespace

std::vector<DetectedTarget> choose_targets(std::vector<FoundTarget> found, const UnreadRings& unread,
                                           DetectionTrace* trace) {
  drop_unlikely(found, unread, trace);
  std::sort(found.begin(), found.end(), [](const FoundTarget& a, const FoundTarget& b) {
    return a.target.id != b.target.id ? a.target.id < b.target.id : is_better(a, b);
  });
  std::vector<DetectedTarget> targets;
  for (auto first = found.begin(); first != found.end();) {
    const auto next =
        std::find_if(first, found.end(), [&](const FoundTarget& f) { return f.target.id != first->target.id; });
    const bool clear = next - first == 1 || is_clearly_better(*first, *(first + 1));
    if (clear) targets.push_back(first->target);
    for (auto left_out = clear ? first + 1 : first; left_out != next; ++left_out)
      note(trace, *left_out, Rejection::id_twice);
    first = next;
  }
  return targets;
}

}  // namespace imprint
