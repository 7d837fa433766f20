#include "node/publish/retry_schedule.h"

#include <catch2/catch.hpp>

namespace imprint {
namespace {

using std::chrono::seconds;
using Places = std::vector<std::uint64_t>;

}  // namespace

TEST_CASE("retry schedule: the oldest first, a few at a time, the next when a receipt has come") {
  const RetrySchedule::Time now{};
  RetrySchedule schedule({.first_timeout_s = 5, .last_timeout_s = 60, .in_flight = 2});
  for (const std::uint64_t place : {3, 1, 2}) schedule.add(place);
  REQUIRE(schedule.due(now) == Places{1, 2});
  schedule.sent(1, now);
  schedule.sent(2, now);
  REQUIRE(schedule.due(now).empty());
  schedule.remove(2);
  REQUIRE(schedule.due(now) == Places{3});
}

TEST_CASE("retry schedule: without a receipt the pause doubles up to its limit") {
  RetrySchedule::Time now{};
  RetrySchedule schedule({.first_timeout_s = 5, .last_timeout_s = 15, .in_flight = 2});
  schedule.add(1);
  for (const int pause_s : {5, 10, 15, 15}) {
    schedule.sent(1, now);
    REQUIRE(schedule.next_timeout() == now + seconds(pause_s));
    REQUIRE(schedule.due(now + seconds(pause_s) - std::chrono::milliseconds(1)).empty());
    now += seconds(pause_s);
    REQUIRE(schedule.due(now) == Places{1});
  }
}

TEST_CASE("retry schedule: what is never answered does not keep the others back") {
  RetrySchedule::Time now{};
  RetrySchedule schedule({.first_timeout_s = 5, .last_timeout_s = 60, .in_flight = 2});
  for (std::uint64_t place = 1; place <= 6; ++place) schedule.add(place);
  Places sent;
  for (int round = 0; round < 3; ++round, now += seconds(5)) {
    for (const std::uint64_t place : schedule.due(now)) {
      schedule.sent(place, now);
      sent.push_back(place);
    }
  }
  REQUIRE(sent == Places{1, 2, 3, 4, 5, 6});
}

TEST_CASE("retry schedule: when fusion is back everything is due at once") {
  const RetrySchedule::Time now{};
  RetrySchedule schedule({});
  schedule.sent(1, now);
  REQUIRE(schedule.due(now).empty());
  schedule.begin_anew();
  REQUIRE(schedule.due(now) == Places{1});
}

}  // namespace imprint
