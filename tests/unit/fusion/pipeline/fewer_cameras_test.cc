// What is left when a camera is lost, covered, or badly placed: a result that says so with wider intervals, or none.
#include <algorithm>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <catch2/catch.hpp>

#include "fusion/fusion_pipeline.h"
#include "tests/unit/fusion/triangulate/forging_sessions.h"

namespace imprint::test {
namespace {

Rod forging() {
  Rod rod = bent_rod();
  make_out_of_round(rod, 3.0, 250.0, 31);
  return rod;
}

/// Three observations at 60 degrees with the noise and the poses of a forge.
Session seen() {
  return observe(forging(), {.observations = 3, .step_deg = 60.0, .noise_px = 0.15, .pose_sigma_mm = 0.3, .seed = 31});
}

std::vector<Observation> observations_of(const Session& session) {
  std::vector<Observation> observations;
  for (std::size_t k = 0; k < session.imprints.size(); ++k)
    observations.push_back({.index = static_cast<int>(k),
                            .rotation_deg = session.rotations_deg[k],
                            .imprints = session.imprints[k],
                            .missing = {}});
  return observations;
}

bool warns(const Measurement& measurement, std::string_view of) {
  return std::any_of(measurement.warnings.begin(), measurement.warnings.end(),
                     [&](const std::string& warning) { return warning.find(of) != std::string::npos; });
}

/// Means of the intervals over the sections from `from` to `to`, as shares of their number.
struct Widths {
  double axis = 0.0, diameter = 0.0;
};
Widths widths_of(const Measurement& measurement, double from, double to) {
  Widths widths;
  const auto count = static_cast<double>(measurement.sections.size());
  double sections = 0.0;
  for (auto i = static_cast<std::size_t>(from * count); i < static_cast<std::size_t>(to * count); ++i) {
    widths.axis += measurement.sections[i].axis_ci95_mm;
    widths.diameter += measurement.sections[i].diameter_ci95_mm;
    sections += 1.0;
  }
  return {widths.axis / sections, widths.diameter / sections};
}

}  // namespace

TEST_CASE("fuse: with one camera lost there is a result with wider intervals that hold, and it names the camera") {
  const Session session = seen();
  const auto full = fuse(observations_of(session), session.spec, "s", "best");
  REQUIRE(full);
  std::vector<Observation> observations = observations_of(session);
  for (Observation& observation : observations) {
    observation.imprints.pop_back();
    observation.missing.emplace_back("cam3", "no imprint within 5 s");
  }
  const auto fewer = fuse(observations, session.spec, "s", "best");
  REQUIRE(fewer);
  const Deviation d = deviation(*fewer, forging(), session);
  INFO(text(d));
  CHECK(widths_of(*fewer, 0.0, 1.0).axis > 1.05 * widths_of(*full, 0.0, 1.0).axis);
  CHECK(widths_of(*fewer, 0.0, 1.0).diameter > widths_of(*full, 0.0, 1.0).diameter);
  CHECK(d.axis_covered > 0.9);
  CHECK(d.diameter_covered > 0.9);
  CHECK(warns(*fewer, "camera cam3 left out"));
}

TEST_CASE("fuse: with half a camera's view covered the intervals are wider over that half only, and it says so") {
  const Session session = seen();
  const auto full = fuse(observations_of(session), session.spec, "s", "best");
  REQUIRE(full);
  CHECK_FALSE(warns(*full, "neither rim"));
  std::vector<Observation> observations = observations_of(session);
  for (Observation& observation : observations) {
    Imprint& covered = observation.imprints[0];
    for (ImprintCurve* curve : {&covered.upper, &covered.lower, &covered.axis})
      std::fill(curve->weight.begin() + kImprintStations / 2, curve->weight.end(), 0.0);
    covered.end.visible = false;
  }
  const auto fewer = fuse(observations, session.spec, "s", "best");
  REQUIRE(fewer);
  const Deviation d = deviation(*fewer, forging(), session);
  INFO(text(d));
  // Which half of the forging it is hangs on the side the camera stands on.
  const auto wider = [&](double from, double to) {
    return widths_of(*fewer, from, to).diameter / widths_of(*full, from, to).diameter;
  };
  const double first = wider(0.05, 0.4), last = wider(0.6, 0.95);
  INFO("diameter's intervals grow by " << first << " and " << last);
  CHECK(std::max(first, last) > 1.05);
  CHECK(std::min(first, last) < 1.0 + 0.5 * (std::max(first, last) - 1.0));
  CHECK(d.axis_covered > 0.9);
  CHECK(d.diameter_covered > 0.9);
  CHECK(warns(*fewer, "camera cam1 sees neither rim over 50 %"));
}

TEST_CASE("fuse: two cameras 10 degrees apart are refused by name; 20 degrees apart the intervals are wide and hold") {
  const Rod rod = forging();
  const auto pair = [&](double apart_deg) {
    Session session;
    session.rotations_deg = {0.0};
    session.imprints.emplace_back();
    std::mt19937 generator(4);
    for (const double side : {-0.5, 0.5}) {
      Imprint imprint =
          view_rod(rod, session.first, pinhole(side < 0.0 ? "left" : "right", 90.0 + side * apart_deg, 7400.0));
      add_noise(imprint, 0.15, generator);
      session.imprints.back().push_back(std::move(imprint));
    }
    return session;
  };
  const Session near = pair(10.0);
  const auto refused = fuse(observations_of(near), near.spec, "s", "best");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().kind == ErrorKind::job_failed);
  CHECK(refused.error().message.find("left, right") != std::string::npos);

  const Session apart = pair(20.0), wide = pair(90.0);
  const auto poor = fuse(observations_of(apart), apart.spec, "s", "best");
  const auto good = fuse(observations_of(wide), wide.spec, "s", "best");
  REQUIRE(poor);
  REQUIRE(good);
  const Deviation d = deviation(*poor, rod, apart);
  INFO(text(d));
  // A point from two planes: across their common direction it is known 1 / (2 sin 10 deg) = 2.9 times as badly.
  CHECK(widths_of(*poor, 0.0, 1.0).axis > 1.5 * widths_of(*good, 0.0, 1.0).axis);
  CHECK(d.axis_covered > 0.9);
}

}  // namespace imprint::test
