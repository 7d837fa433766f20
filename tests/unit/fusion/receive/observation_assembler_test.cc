#include "fusion/receive/observation_assembler.h"

#include <algorithm>
#include <random>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

using Time = ObservationAssembler::Time;

const Time kStart = Time(std::chrono::hours(100));

Time after(double s) { return kStart + std::chrono::duration_cast<Time::duration>(std::chrono::duration<double>(s)); }

ObservationAssembler three_cameras(std::size_t max_sessions = 16) {
  return ObservationAssembler({"cam1", "cam2", "cam3"},
                              {.deadline_s = 10.0, .max_sessions = max_sessions, .max_observations = 8});
}

Trigger trigger(std::uint32_t observation, double rotation_deg, std::uint32_t expected,
                const std::string& session = "S") {
  return {session, observation, rotation_deg, 0, expected};
}

Imprint answer(const std::string& camera, std::uint32_t observation, double rotation_deg, std::uint64_t sequence = 0,
               std::uint64_t boot_id = 1, const std::string& session = "S") {
  Imprint imprint;
  imprint.camera_id = camera;
  imprint.session = session;
  imprint.observation = observation;
  imprint.rotation_deg = rotation_deg;
  imprint.boot_id = boot_id;
  imprint.sequence = sequence == 0 ? observation + 1 : sequence;
  return imprint;
}

Imprint failed(Imprint imprint) {
  imprint.failure = "no forging found";
  return imprint;
}

bool mentions(const std::vector<std::string>& lines, const std::string& part) {
  return std::ranges::any_of(lines, [&](const std::string& line) { return line.find(part) != std::string::npos; });
}

}  // namespace

TEST_CASE("receive: an observation settles at once when every camera has reported") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 30.0, 1), after(0)));
  REQUIRE(assembler.add(answer("cam1", 0, 30.0), after(0.4)) == Arrival::taken);
  REQUIRE(assembler.add(answer("cam2", 0, 30.0), after(0.5)) == Arrival::taken);
  REQUIRE(assembler.settle(after(0.5)).empty());
  REQUIRE(assembler.add(answer("cam3", 0, 30.0), after(0.6)) == Arrival::taken);
  REQUIRE(assembler.settle(after(0.6)) == std::vector<std::string>{"S"});
  REQUIRE(assembler.complete("S"));
  const auto observations = assembler.observations("S");
  REQUIRE(observations.size() == 1);
  REQUIRE(observations[0].imprints.size() == 3);
  REQUIRE(observations[0].missing.empty());
  REQUIRE(observations[0].rotation_deg == 30.0);
  REQUIRE(assembler.warnings("S").empty());
  REQUIRE(assembler.settle(after(100)).empty());
  REQUIRE_FALSE(assembler.next_deadline());
}

TEST_CASE("receive: a failed imprint is a report and nobody waits for its camera") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 1), after(0)));
  assembler.add(answer("cam1", 0, 0.0), after(1));
  assembler.add(failed(answer("cam2", 0, 0.0)), after(1));
  assembler.add(answer("cam3", 0, 0.0), after(1));
  REQUIRE(assembler.settle(after(1)).size() == 1);
  REQUIRE(assembler.observations("S")[0].imprints[1].failure == "no forging found");
}

TEST_CASE("receive: after the deadline the missing cameras are named with why") {
  auto assembler = three_cameras();
  assembler.set_alive("cam3", true);
  REQUIRE(assembler.add(trigger(0, 0.0, 1), after(0)));
  assembler.add(answer("cam1", 0, 0.0), after(1));
  REQUIRE(assembler.next_deadline() == after(10));
  REQUIRE(assembler.settle(after(9.999)).empty());
  REQUIRE(assembler.settle(after(10)) == std::vector<std::string>{"S"});
  const auto observation = assembler.observations("S").at(0);
  REQUIRE(observation.imprints.size() == 1);
  REQUIRE(observation.missing.size() == 2);
  REQUIRE(observation.missing[0] ==
          std::pair<std::string, std::string>("cam2", "not connected, no imprint within 10 s"));
  REQUIRE(observation.missing[1] ==
          std::pair<std::string, std::string>("cam3", "connected, but no imprint within 10 s"));
  REQUIRE(assembler.complete("S"));
}

TEST_CASE("receive: an observation nobody answers settles as well") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 1), after(0)));
  REQUIRE(assembler.settle(after(11)).size() == 1);
  REQUIRE(assembler.observations("S").at(0).missing.size() == 3);
}

TEST_CASE("receive: a late imprint makes the session due again and takes its camera off the missing") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 1), after(0)));
  assembler.add(answer("cam1", 0, 0.0), after(1));
  assembler.add(answer("cam2", 0, 0.0), after(1));
  REQUIRE(assembler.settle(after(10)).size() == 1);
  REQUIRE(assembler.observations("S")[0].missing.size() == 1);
  REQUIRE(assembler.add(answer("cam3", 0, 0.0), after(60)) == Arrival::taken);
  REQUIRE(assembler.settle(after(60)).size() == 1);
  REQUIRE(assembler.observations("S")[0].imprints.size() == 3);
  REQUIRE(assembler.observations("S")[0].missing.empty());
}

TEST_CASE("receive: the same imprint once more changes nothing") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 1), after(0)));
  for (const char* camera : {"cam1", "cam2", "cam3"}) assembler.add(answer(camera, 0, 0.0), after(1));
  REQUIRE(assembler.settle(after(1)).size() == 1);
  REQUIRE(assembler.add(answer("cam2", 0, 0.0), after(2)) == Arrival::repeated);
  REQUIRE(assembler.settle(after(2)).empty());
  REQUIRE(assembler.warnings("S").empty());
}

TEST_CASE("receive: a node restarted in the middle cannot change what it has answered") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 1), after(0)));
  assembler.add(answer("cam1", 0, 0.0, 7, 1), after(1));
  REQUIRE(assembler.add(answer("cam1", 0, 0.0, 1, 2), after(3)) == Arrival::surplus);
  assembler.settle(after(10));
  REQUIRE(assembler.observations("S")[0].imprints[0].boot_id == 1);
  REQUIRE(mentions(assembler.warnings("S"), "cam1 answered more than once"));
}

TEST_CASE("receive: a failed imprint gives way to a good one, never the other way round") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 1), after(0)));
  assembler.add(failed(answer("cam1", 0, 0.0, 1)), after(1));
  REQUIRE(assembler.add(failed(answer("cam1", 0, 0.0, 1)), after(1)) == Arrival::repeated);
  REQUIRE(assembler.add(answer("cam1", 0, 0.0, 2), after(2)) == Arrival::replaced);
  REQUIRE(assembler.add(failed(answer("cam1", 0, 0.0, 3)), after(3)) == Arrival::surplus);
  assembler.settle(after(10));
  REQUIRE(assembler.observations("S")[0].imprints[0].sequence == 2);
}

TEST_CASE("receive: of two failed imprints of one boot the later in sequence stands, whatever the order of arrival") {
  auto assembler = three_cameras();
  assembler.add(failed(answer("cam1", 0, 0.0, 5)), after(1));
  REQUIRE(assembler.add(failed(answer("cam1", 0, 0.0, 4)), after(2)) == Arrival::surplus);
  REQUIRE(assembler.add(failed(answer("cam1", 0, 0.0, 6)), after(3)) == Arrival::replaced);
}

TEST_CASE("receive: imprints ahead of their trigger are kept and the trigger's rotation counts") {
  auto assembler = three_cameras();
  assembler.add(answer("cam1", 1, 89.0), after(0));
  REQUIRE(assembler.expected("S") == 0);
  REQUIRE(assembler.add(trigger(1, 90.0, 2), after(0.1)));
  REQUIRE(assembler.expected("S") == 2);
  assembler.settle(after(10));
  const auto observation = assembler.observations("S").at(0);
  REQUIRE(observation.index == 1);
  REQUIRE(observation.rotation_deg == 90.0);
  REQUIRE(observation.imprints[0].rotation_deg == 90.0);
  REQUIRE(mentions(assembler.warnings("S"), "imprints say rotation 89 deg, the trigger 90 deg"));
}

TEST_CASE("receive: without a trigger the imprints' rotation counts and a warning says so") {
  auto assembler = three_cameras();
  for (const char* camera : {"cam1", "cam2", "cam3"}) assembler.add(answer(camera, 0, 45.0), after(0));
  REQUIRE(assembler.settle(after(0)).size() == 1);
  REQUIRE(assembler.observations("S")[0].rotation_deg == 45.0);
  REQUIRE_FALSE(assembler.complete("S"));
  REQUIRE(mentions(assembler.warnings("S"), "no trigger was received"));
  // The trigger was only late: the session is due again, because now it is known to be complete.
  REQUIRE(assembler.add(trigger(0, 45.0, 1), after(1)));
  REQUIRE(assembler.settle(after(1)).size() == 1);
  REQUIRE(assembler.complete("S"));
  REQUIRE(assembler.warnings("S").empty());
}

TEST_CASE("receive: a trigger repeated with another rotation does not turn what was seen") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 1), after(0)));
  REQUIRE(assembler.add(trigger(0, 90.0, 1), after(1)));
  assembler.settle(after(10));
  REQUIRE(assembler.observations("S")[0].rotation_deg == 0.0);
  REQUIRE(mentions(assembler.warnings("S"), "triggered again with rotation 90 deg"));
}

TEST_CASE("receive: a session is complete only when all expected observations have settled") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 2), after(0)));
  for (const char* camera : {"cam1", "cam2", "cam3"}) assembler.add(answer(camera, 0, 0.0), after(1));
  REQUIRE(assembler.settle(after(1)).size() == 1);
  REQUIRE_FALSE(assembler.complete("S"));
  REQUIRE(assembler.add(trigger(1, 90.0, 2), after(20)));
  REQUIRE(assembler.settle(after(20)).empty());
  REQUIRE(assembler.observations("S").size() == 1);
  REQUIRE(assembler.settle(after(30)).size() == 1);
  REQUIRE(assembler.observations("S").size() == 2);
  REQUIRE(assembler.complete("S"));
}

TEST_CASE("receive: any order of arrival gives the same observations") {
  std::vector<Imprint> imprints;
  for (std::uint32_t o = 0; o < 3; ++o) {
    for (const char* camera : {"cam1", "cam2", "cam3"}) imprints.push_back(answer(camera, o, 90.0 * o));
  }
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    auto assembler = three_cameras();
    for (std::uint32_t o = 0; o < 3; ++o) REQUIRE(assembler.add(trigger(o, 90.0 * o, 3), after(0)));
    auto shuffled = imprints;
    shuffled.insert(shuffled.end(), imprints.begin(), imprints.begin() + 4);  // some come twice
    std::ranges::shuffle(shuffled, random);
    for (const Imprint& imprint : shuffled) assembler.add(imprint, after(1));
    REQUIRE(assembler.settle(after(1)).size() == 1);
    REQUIRE(assembler.complete("S"));
    const auto observations = assembler.observations("S");
    REQUIRE(observations.size() == 3);
    for (std::size_t o = 0; o < 3; ++o) {
      REQUIRE(observations[o].index == static_cast<int>(o));
      REQUIRE(observations[o].imprints.size() == 3);
      for (std::size_t c = 0; c < 3; ++c) {
        REQUIRE(observations[o].imprints[c].camera_id == fmt::format("cam{}", c + 1));
        REQUIRE(observations[o].imprints[c].observation == o);
      }
    }
  }
}

TEST_CASE("receive: two sessions at once do not mix") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 1, "A"), after(0)));
  REQUIRE(assembler.add(trigger(0, 0.0, 1, "B"), after(0)));
  for (const char* camera : {"cam1", "cam2", "cam3"}) {
    assembler.add(answer(camera, 0, 0.0, 1, 1, "A"), after(1));
    if (camera != std::string("cam2")) assembler.add(answer(camera, 0, 0.0, 2, 1, "B"), after(1));
  }
  REQUIRE(assembler.settle(after(1)) == std::vector<std::string>{"A"});
  REQUIRE(assembler.settle(after(10)) == std::vector<std::string>{"B"});
  REQUIRE(assembler.observations("B")[0].missing.at(0).first == "cam2");
}

TEST_CASE("receive: a camera that is not in the rig is dropped and opens nothing") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(answer("cam9", 0, 0.0), after(0)) == Arrival::unknown_camera);
  REQUIRE_FALSE(assembler.knows("S"));
}

TEST_CASE("receive: an observation index without bounds is refused") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(answer("cam1", 8, 0.0), after(0)) == Arrival::refused);
  REQUIRE_FALSE(assembler.add(trigger(4'000'000'000U, 0.0, 1), after(0)));
  REQUIRE_FALSE(assembler.add(trigger(0, 0.0, 4'000'000'000U), after(0)));
  REQUIRE(assembler.sessions().empty());
}

TEST_CASE("receive: memory stays bounded, a session still open outlives the settled ones") {
  auto assembler = three_cameras(4);
  REQUIRE(assembler.add(trigger(0, 0.0, 1, "open"), after(0)));
  for (int i = 0; i < 100; ++i) {
    const std::string name = fmt::format("S{}", i);
    for (const char* camera : {"cam1", "cam2", "cam3"})
      assembler.add(answer(camera, 0, 0.0, 1, 1, name), after(0.01 * i));
    REQUIRE(assembler.settle(after(0.01 * i)).size() == 1);
    REQUIRE(assembler.sessions().size() <= 4);
  }
  REQUIRE(assembler.knows("open"));
  REQUIRE(assembler.knows("S99"));
  REQUIRE_FALSE(assembler.knows("S0"));
}

TEST_CASE("receive: open triggers are those a camera has still to answer") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 2), after(0)));
  assembler.add(answer("cam1", 0, 0.0), after(1));
  REQUIRE(assembler.open_triggers("cam1").empty());
  REQUIRE(assembler.open_triggers("cam2").size() == 1);
  REQUIRE(assembler.open_triggers("cam2")[0].observation == 0);
  assembler.settle(after(10));
  REQUIRE(assembler.open_triggers("cam2").empty());
}

TEST_CASE("receive: an imprint that comes after the evaluation is late, and the result says so") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 1), after(0)));
  assembler.add(answer("cam1", 0, 0.0), after(0.1));
  assembler.add(answer("cam2", 0, 0.0), after(0.1));
  const Imprint third = answer("cam3", 0, 0.0);
  REQUIRE_FALSE(assembler.is_late(third, after(9.9)));
  REQUIRE(assembler.is_late(third, after(10.0)));
  assembler.settle(after(11));
  REQUIRE(assembler.is_late(third, after(11)));
  REQUIRE_FALSE(assembler.is_late(answer("cam2", 0, 0.0), after(11)));  // it is there
  REQUIRE_FALSE(assembler.is_late(answer("cam3", 1, 0.0), after(11)));  // nobody has waited for that one
  assembler.add(third, after(12), {.late = true});
  REQUIRE(assembler.settle(after(12)) == std::vector<std::string>{"S"});
  REQUIRE(mentions(assembler.warnings("S"), "the imprint of cam3 came late"));
}

TEST_CASE("receive: a clock that is off by an hour harms no grouping, is corrected and named") {
  auto assembler = three_cameras();
  const std::int64_t hour_ns = 3'600'000'000'000, now_ns = 1'700'000'000'000'000'000;
  REQUIRE(assembler.add(trigger(0, 0.0, 1), after(0)));
  for (const char* camera : {"cam1", "cam2", "cam3"}) {
    Imprint imprint = answer(camera, 0, 0.0);
    const std::int64_t offset_ns = camera == std::string("cam2") ? hour_ns : 1'000'000;
    imprint.sensor_time_ns = now_ns + offset_ns;
    assembler.add(imprint, after(1), {.clock_offset_ns = offset_ns});
  }
  REQUIRE(assembler.settle(after(1)) == std::vector<std::string>{"S"});
  REQUIRE(assembler.observations("S")[0].imprints.size() == 3);
  const auto warnings = assembler.warnings("S");
  REQUIRE(warnings.size() == 1);
  REQUIRE(mentions(warnings, "the clock of cam2 was 3600.0 s ahead of fusion's"));
}

TEST_CASE("receive: frames that were not taken at the same time are named, as far as clocks are known") {
  auto assembler = three_cameras();
  REQUIRE(assembler.add(trigger(0, 0.0, 1), after(0)));
  for (const auto& [camera, s] : {std::pair("cam1", 0.0), std::pair("cam2", 2.5), std::pair("cam3", 900.0)}) {
    Imprint imprint = answer(camera, 0, 0.0);
    imprint.sensor_time_ns = static_cast<std::int64_t>(1e9 * s);
    Circumstances circumstances;
    if (s < 100.0) circumstances.clock_offset_ns = 0;  // that of the third has not been measured
    assembler.add(imprint, after(1), circumstances);
  }
  assembler.settle(after(1));
  REQUIRE(assembler.warnings("S") ==
          std::vector<std::string>{
              "observation 0: cam2 took its frame 2.5 s after cam1; the forging must have stood still"});
}

TEST_CASE("receive: a session that leaves with its result still to be made is given back") {
  auto assembler = three_cameras(2);
  assembler.add(answer("cam1", 0, 0.0, 1, 1, "A"), after(0));
  assembler.add(answer("cam1", 0, 0.0, 2, 1, "B"), after(1));
  REQUIRE_FALSE(assembler.has_room());
  assembler.add(answer("cam1", 0, 0.0, 3, 1, "C"), after(2));
  REQUIRE(assembler.take_displaced() == std::vector<std::string>{"A"});
  REQUIRE(assembler.take_displaced().empty());
  assembler.settle(after(20));
  REQUIRE(assembler.has_room());
  assembler.add(answer("cam1", 0, 0.0, 4, 1, "D"), after(21));
  REQUIRE(assembler.take_displaced().empty());  // the one that left was settled
}

}  // namespace imprint
