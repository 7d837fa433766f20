#include "lib/daemon/bounded_queue.h"

#include <thread>

#include <catch2/catch.hpp>

namespace imprint {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

TEST_CASE("queue: what does not fit is refused, what fits comes out in order") {
  BoundedQueue<int> queue(2);
  REQUIRE(queue.push(1));
  REQUIRE(queue.push(2));
  REQUIRE_FALSE(queue.push(3));
  REQUIRE(queue.pop() == 1);
  REQUIRE(queue.push(4));
  REQUIRE(queue.try_pop() == 2);
  REQUIRE(queue.pop_until(steady_clock::now()) == 4);
  REQUIRE_FALSE(queue.try_pop());
}

TEST_CASE("queue: waiting ends at its time, or at once when something comes") {
  BoundedQueue<int> queue(2);
  const auto begin = steady_clock::now();
  REQUIRE_FALSE(queue.pop_until(begin + 30ms));
  REQUIRE(steady_clock::now() - begin >= 30ms);
  std::thread giver([&] {
    std::this_thread::sleep_for(20ms);
    queue.push(7);
  });
  REQUIRE(queue.pop_until(steady_clock::now() + 30s) == 7);
  giver.join();
}

TEST_CASE("queue: closed it gives what it holds and takes no more, dropped it gives nothing") {
  BoundedQueue<int> closed(2);
  closed.push(1);
  closed.close();
  REQUIRE_FALSE(closed.push(2));
  REQUIRE_FALSE(closed.finished());
  REQUIRE(closed.pop() == 1);
  REQUIRE_FALSE(closed.pop());
  REQUIRE(closed.finished());

  BoundedQueue<int> dropped(2);
  dropped.push(1);
  std::thread waiting([&] {
    while (dropped.pop()) continue;
  });
  dropped.drop();
  waiting.join();
  REQUIRE(dropped.finished());
}

}  // namespace imprint
