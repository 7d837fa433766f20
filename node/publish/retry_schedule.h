#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

struct RetryConfig {
  double first_timeout_s = 5.0;  // an imprint without a receipt for so long is sent again; ours: a 64 kbit/s link is
                                 // through with `in_flight` imprints by then
  double last_timeout_s = 60.0;  // the timeout doubles up to this
  std::size_t in_flight = 4;     // sent again and waiting for a receipt at a time: receipts set the pace

  [[nodiscard]] Result<void> validate() const;
};

/// When which of the spooled imprints is sent (again). Those least often sent go first, of these the oldest: one that
/// fusion cannot read does not keep the others back. Knows no clock.
class RetrySchedule {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit RetrySchedule(RetryConfig config) : config_(config) {}

  /// A new one that has not been sent yet; `place` orders by age.
  void add(std::uint64_t place) { attempts_[place]; }
  void sent(std::uint64_t place, Time now);
  void remove(std::uint64_t place) { attempts_.erase(place); }
  /// The other side has come (back): everything is due as if never sent.
  void begin_anew();

  /// What may be sent now.
  [[nodiscard]] std::vector<std::uint64_t> due(Time now) const;
  /// When the next one runs out of time; none when nothing is on its way.
  [[nodiscard]] std::optional<Time> next_timeout() const;

 private:
  struct Attempt {
    int sends = 0;
    Time timeout{};  // of the last one
  };

  RetryConfig config_;
  std::map<std::uint64_t, Attempt> attempts_;
};

}  // namespace imprint
