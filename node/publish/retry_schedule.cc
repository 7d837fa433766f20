#include "node/publish/retry_schedule.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace imprint {

Result<void> RetryConfig::validate() const {
  if (!(first_timeout_s >= 0.1 && first_timeout_s <= last_timeout_s)) {
    return invalid_input("first_timeout_s: expected 0.1 to last_timeout_s ({}), found {}", last_timeout_s,
                         first_timeout_s);
  }
  if (!(last_timeout_s <= 3600.0))
    return invalid_input("last_timeout_s: expected at most 3600, found {}", last_timeout_s);
  if (in_flight < 1) return invalid_input("in_flight: expected at least 1, found 0");
  return {};
}

void RetrySchedule::sent(std::uint64_t place, Time now) {
  Attempt& attempt = attempts_[place];
  const double timeout_s =
      std::min(config_.first_timeout_s * std::exp2(std::min(attempt.sends, 30)), config_.last_timeout_s);
  ++attempt.sends;
  attempt.timeout = now + std::chrono::duration_cast<Time::duration>(std::chrono::duration<double>(timeout_s));
}

void RetrySchedule::begin_anew() {
  for (auto& [place, attempt] : attempts_) attempt = {};
}

std::vector<std::uint64_t> RetrySchedule::due(Time now) const {
  std::vector<std::pair<int, std::uint64_t>> waiting;  // how often sent, place
  std::size_t in_flight = 0;
  for (const auto& [place, attempt] : attempts_) {
    if (attempt.sends > 0 && now < attempt.timeout) {
      ++in_flight;
    } else {
      waiting.emplace_back(attempt.sends, place);
    }
  }
  const std::size_t free = config_.in_flight - std::min(in_flight, config_.in_flight);
  const std::size_t count = std::min(free, waiting.size());
  std::partial_sort(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(count), waiting.end());
  std::vector<std::uint64_t> due;
  for (std::size_t i = 0; i < count; ++i) due.push_back(waiting[i].second);
  return due;
}

std::optional<RetrySchedule::Time> RetrySchedule::next_timeout() const {
  std::optional<Time> next;
  for (const auto& [place, attempt] : attempts_) {
    if (attempt.sends > 0 && (!next || attempt.timeout < *next)) next = attempt.timeout;
  }
  return next;
}

}  // namespace imprint
