#include "fusion/plc_input.h"

#include <atomic>

#include <catch2/catch.hpp>

#include "lib/wire/keys.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

RisingEdge::Time at(int ms) { return RisingEdge::Time(milliseconds(ms)); }

}  // namespace

TEST_CASE("plc: a contact that bounces makes one edge, after it has stood still") {
  RisingEdge edge(milliseconds(20));
  REQUIRE_FALSE(edge.note(false, at(0)));
  for (int ms = 1; ms < 10; ++ms) REQUIRE_FALSE(edge.note(ms % 2 == 0, at(ms)));
  REQUIRE_FALSE(edge.note(true, at(10)));
  REQUIRE_FALSE(edge.note(true, at(29)));
  REQUIRE(edge.note(true, at(30)));
  REQUIRE_FALSE(edge.note(true, at(500)));
  REQUIRE_FALSE(edge.note(false, at(501)));
  REQUIRE_FALSE(edge.note(true, at(505)));  // a glitch, not a new rise
  REQUIRE_FALSE(edge.note(true, at(600)));
}

TEST_CASE("plc: an input that is high from the start has not risen") {
  RisingEdge edge(milliseconds(0));
  REQUIRE_FALSE(edge.note(true, at(0)));
  REQUIRE_FALSE(edge.note(true, at(100)));
  REQUIRE_FALSE(edge.note(false, at(200)));
  REQUIRE(edge.note(true, at(300)));
}

TEST_CASE("plc: edges count through a session, the next one begins after the last or after a long pause") {
  SessionPlan plan{.session = "plc"};
  plan.observations = 2;
  TriggerSessions sessions(plan);
  const Trigger first = sessions.next(at(0), 0);
  REQUIRE(first.session == "plc-19700101T000000.000");
  REQUIRE(check_id("session", first.session));
  REQUIRE(first.observations_expected == 2);
  const Trigger second = sessions.next(at(1000), 1'000'000'000);
  REQUIRE(second.session == first.session);
  REQUIRE(second.observation == 1);
  REQUIRE(second.rotation_deg == 60.0);
  const Trigger third = sessions.next(at(2000), 2'000'000'000);
  REQUIRE(third.session == "plc-19700101T000002.000");
  REQUIRE(third.observation == 0);
  const Trigger late = sessions.next(at(2000) + seconds(120), 122'000'000'000);
  REQUIRE(late.session != third.session);
  REQUIRE(late.observation == 0);
}

TEST_CASE("plc: a file that rises fires, one that cannot be read is refused") {
  const TemporaryFolder folder;
  LineControl control;
  std::atomic<int> fired = 0;
  control.connect([&](const Trigger&) -> Result<void> {
    ++fired;
    return {};
  });
  PlcConfig config;
  config.input = folder / "input";
  REQUIRE_FALSE(PlcInput::start(config, control));
  folder.write("input", "2");
  REQUIRE_FALSE(PlcInput::start(config, control));
  folder.write("input", "0\n");
  const auto input = PlcInput::start(config, control);
  REQUIRE(input);
  std::this_thread::sleep_for(milliseconds(100));
  REQUIRE(fired == 0);
  folder.write("input", "1\n");
  for (int i = 0; i < 500 && fired == 0; ++i) std::this_thread::sleep_for(milliseconds(10));
  std::this_thread::sleep_for(milliseconds(100));
  REQUIRE(fired == 1);
}

}  // namespace imprint
