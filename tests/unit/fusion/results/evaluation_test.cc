#include "fusion/results/evaluation.h"

#include <cmath>

#include <catch2/catch.hpp>

#include "fusion/combine/combine_config.h"
#include "fusion/results/roundness.h"
#include "fusion/results/straightness.h"
#include "fusion/triangulate/triangulate_config.h"
#include "tests/unit/fusion/triangulate/forging_sessions.h"

namespace imprint::test {
namespace {

CombinedForging combined(const Session& session) {
  std::vector<ObservedForging> observed;
  for (const auto& imprints : session.imprints) {
    auto one = triangulate(imprints, session.spec, TriangulateConfig{});
    REQUIRE(one.has_value());
    observed.push_back(std::move(*one));
  }
  auto forging = combine(observed, session.rotations_deg, session.spec, CombineConfig{});
  REQUIRE(forging.has_value());
  return std::move(*forging);
}

struct TrueValues {
  double max_deflection = 0.0, minimum_zone = 0.0, per_metre = 0.0, mean_diameter = 0.0;
};

TrueValues true_values(const Rod& rod, double end_section_mm) {
  const AlignedRod aligned(rod, end_section_mm);
  std::vector<double> s;
  std::vector<Eigen::Vector2d> axis;
  TrueValues values;
  for (int i = 0; i < 500; ++i) {
    s.push_back(rod.length_mm * i / 499.0);
    axis.push_back(aligned.axis(s.back()));
    values.max_deflection = std::max(values.max_deflection, axis.back().norm());
    values.mean_diameter += aligned.diameter(s.back()) / 500.0;
  }
  values.minimum_zone = minimum_zone_mm(s, axis);
  values.per_metre = bow_over_mm(s, axis, 1000.0);
  return values;
}

}  // namespace

TEST_CASE("evaluation: exact views of a round bent rod give its straightness to 0.02 mm, and nothing out of round") {
  const Rod rod = bent_rod();
  const Session session = observe(rod, {});
  const CombinedForging forging = combined(session);
  const TrueValues truth = true_values(rod, session.spec.end_section_mm);
  const Straightness straight = evaluate_straightness(forging);
  CHECK(straight.max_deflection.mm == Approx(truth.max_deflection).margin(0.02));
  CHECK(straight.minimum_zone.mm == Approx(truth.minimum_zone).margin(0.02));
  CHECK(straight.per_metre.mm == Approx(truth.per_metre).margin(0.02));
  CHECK(straight.total_indicator.mm == Approx(2.0 * truth.max_deflection).margin(0.05));  // a round section's runout
  CHECK(evaluate_diameters(forging).mean.mm == Approx(260.0).margin(0.02));
  const auto round = evaluate_roundness(forging);
  REQUIRE(round.size() == 500);
  for (const SectionRoundness& section : round) CHECK(section.minimum_zone.mm < 0.1);
}

TEST_CASE("evaluation: out-of-round sections are found by all three references, ends left out") {
  Rod rod = bent_rod();
  make_out_of_round(rod, 3.0, 300.0, 9);
  const Session session = observe(rod, {.observations = 6, .noise_px = 0.1, .seed = 9});
  const CombinedForging forging = combined(session);
  const auto round = evaluate_roundness(forging);
  REQUIRE(round.size() == 500);
  double squares = 0.0, inside = 0.0;
  for (std::size_t i = 20; i < 480; ++i) {
    std::vector<Eigen::Vector2d> profile;
    for (int j = 0; j < 72; ++j) {
      const Eigen::Vector3d point = rod.surface(forging.sections[i].s_mm, j * M_PI / 36.0);
      profile.emplace_back(point.tail<2>());
    }
    const Roundness truth = roundness(profile);
    const double off = round[i].minimum_zone.mm - truth.minimum_zone_mm;
    squares += off * off / 460.0;
    inside += std::abs(off) <= round[i].minimum_zone.ci95_mm ? 1.0 / 460.0 : 0.0;
    CHECK(round[i].least_squares.mm >= round[i].minimum_zone.mm - 0.05);
  }
  INFO("minimum zone RMS " << std::sqrt(squares) << ", covered " << inside);
  CHECK(std::sqrt(squares) < 0.35);
  CHECK(inside > 0.85);
}

TEST_CASE("evaluation: the 95 % intervals of straightness and mean diameter hold the truth of most rods") {
  // Eight rods, four values each: fewer than 27 of 32 within happen once in a thousand with honest 95 %.
  int inside = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    Rod rod = bent_rod();
    make_out_of_round(rod, 1.0 + 0.5 * (seed % 4), 150.0 + 50.0 * (seed % 3), 60 + seed);
    const Session session = observe(rod, {.noise_px = 0.1, .pose_sigma_mm = 0.3, .seed = 60 + seed});
    const CombinedForging forging = combined(session);
    const Straightness straight = evaluate_straightness(forging);
    const TrueValues truth = true_values(rod, session.spec.end_section_mm);
    const auto holds = [&](const Length& length, double value) {
      INFO("rod " << seed << ": " << length.mm << " +- " << length.ci95_mm << ", truly " << value);
      CHECK(length.ci95_mm > 0.0);
      CHECK(length.ci95_mm < 5.0);
      inside += std::abs(length.mm - value) <= length.ci95_mm ? 1 : 0;
    };
    holds(straight.max_deflection, truth.max_deflection);
    holds(straight.minimum_zone, truth.minimum_zone);
    holds(straight.per_metre, truth.per_metre);
    holds(evaluate_diameters(forging).mean, truth.mean_diameter);
  }
  CHECK(inside >= 27);
}

TEST_CASE("evaluation: without shapes there is no roundness, and straightness has no interval") {
  CombinedForging forging = combined(observe(bent_rod(), {}));
  forging.shape.clear();
  forging.draws.clear();
  CHECK(evaluate_roundness(forging).empty());
  const Straightness straight = evaluate_straightness(forging);
  CHECK(straight.max_deflection.ci95_mm == 0.0);
  CHECK(straight.total_indicator.mm == Approx(2.0 * straight.max_deflection.mm));
}

}  // namespace imprint::test
