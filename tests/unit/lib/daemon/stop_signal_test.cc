#include "lib/daemon/stop_signal.h"

#include <csignal>
#include <thread>

#include <unistd.h>

#include <catch2/catch.hpp>

namespace imprint {

using namespace std::chrono_literals;

TEST_CASE("stop signal: waiting ends at its time without a signal and at once with one, from then on always") {
  StopSignal stop;
  REQUIRE_FALSE(stop.wait_for(10ms));
  ::kill(::getpid(), SIGTERM);
  const auto begin = std::chrono::steady_clock::now();
  REQUIRE(stop.wait_for(30s));
  REQUIRE(std::chrono::steady_clock::now() - begin < 10s);
  REQUIRE(stop.wait_for(0ms));
}

TEST_CASE("stop signal: a wait of no time still sees a signal that has come") {
  StopSignal stop;
  ::kill(::getpid(), SIGINT);
  REQUIRE(stop.wait_for(0ms));
}

}  // namespace imprint
