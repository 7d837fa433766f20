#include "lib/clock/wall_clock.h"

#include <chrono>
#include <ctime>

#include <fmt/chrono.h>

namespace imprint {

std::int64_t wall_clock_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::string utc_text(std::int64_t time_ns) {
  const std::int64_t second_ns = 1'000'000'000;
  std::int64_t seconds = time_ns / second_ns;
  std::int64_t rest_ns = time_ns % second_ns;
  if (rest_ns < 0) {
    rest_ns += second_ns;
    --seconds;
  }
  const std::time_t whole = seconds;
  std::tm utc{};
  gmtime_r(&whole, &utc);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", utc, rest_ns / 1'000'000);
}

}  // namespace imprint
