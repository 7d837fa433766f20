#include "fusion/faceted/faceted.h"

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include "fusion/faceted/section_evidence.h"
#include "fusion/fusion_pipeline.h"
#include "tests/unit/fusion/triangulate/forging_sessions.h"

namespace imprint {
namespace {

using namespace imprint::test;

Result<Measurement> fused(const Session& session, SectionKind told = SectionKind::unknown) {
  std::vector<Observation> observations;
  for (std::size_t k = 0; k < session.imprints.size(); ++k)
    observations.push_back({static_cast<int>(k), session.rotations_deg[k], session.imprints[k], {}});
  ForgingSpec spec = session.spec;
  spec.diameter_max_mm = 450.0;
  spec.section = told;
  return fuse(observations, spec, "bar", "best");
}

/// Errors of the widths and the share of their intervals that hold, over all sections; the largest without a hundredth
/// of the length at either end, which the outline of the end's face hides from most cameras.
struct WidthErrors {
  double rms = 0.0, largest = 0.0, covered = 0.0;
};

WidthErrors width_errors(const Measurement& m, std::vector<double> truth) {
  WidthErrors errors;
  double count = 0.0;
  std::ranges::sort(truth);
  for (std::size_t s = 0; s < m.facets.size(); ++s) {
    const bool inside = s >= m.facets.size() / 100 && s < m.facets.size() - m.facets.size() / 100;
    std::vector<SectionFacets::Value> widths = m.facets[s].widths_mm;
    std::ranges::sort(widths, {}, &SectionFacets::Value::value);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const double error = std::abs(widths[i].value - truth[i]);
      errors.rms += error * error;
      if (inside) errors.largest = std::max(errors.largest, error);
      errors.covered += error <= 1.96 * widths[i].sigma ? 1.0 : 0.0;
      count += 1.0;
    }
  }
  errors.rms = std::sqrt(errors.rms / count);
  errors.covered /= count;
  return errors;
}

}  // namespace

TEST_CASE("faceted: a 300 x 300 bar from six observations is known to be square, its widths to 0.3 mm") {
  const Session session = observe_hull(edges_of({.twist_deg = 4.0}),
                                       {.observations = 6, .noise_px = 0.15, .pose_sigma_mm = 0.2, .seed = 4});
  const auto m = fused(session);
  REQUIRE(m);
  CHECK(m->section_kind == SectionKind::square);
  REQUIRE(m->facets.size() == m->sections.size());
  const WidthErrors errors = width_errors(*m, {300.0, 300.0});
  INFO("rms " << errors.rms << ", largest " << errors.largest << ", covered " << errors.covered);
  CHECK(errors.rms < 0.15);      // what 0.15 px, 0.2 mm each, leave of some nine tangents a corner
  CHECK(errors.largest < 0.45);  // of 1,000 widths; the goal is 0.3 mm as a sigma
  CHECK(errors.covered > 0.9);
  const SectionFacets& last = m->facets.back();
  CHECK(last.twist_deg.value == Approx(4.0).margin(0.25));  // between the two ends, where least is seen
  CHECK(std::abs(last.twist_deg.value - 4.0) <= 1.96 * last.twist_deg.sigma);
  for (const SectionFacets& facets : m->facets) {
    CHECK(std::abs(facets.squareness_deg.value) < 0.15);
    CHECK(facets.corner_radius_mm.value == Approx(25.0).margin(1.0));
  }
  CHECK(m->length_mm == Approx(1900.0).margin(1.0));
}

TEST_CASE("faceted: a rectangle and an octagon are told from each other and measured") {
  const auto rectangle = fused(
      observe_hull(edges_of({.stretch = 1.2, .turn_deg = 30.0}), {.observations = 6, .noise_px = 0.1, .seed = 5}));
  REQUIRE(rectangle);
  CHECK(rectangle->section_kind == SectionKind::rectangle);
  CHECK(width_errors(*rectangle, {300.0, 360.0}).largest < 0.4);

  const auto octagon = fused(observe_hull(edges_of({.corners = 8}), {.observations = 6, .noise_px = 0.1, .seed = 6}));
  REQUIRE(octagon);
  CHECK(octagon->section_kind == SectionKind::octagon);
  CHECK(width_errors(*octagon, {300.0, 300.0, 300.0, 300.0}).rms < 0.3);
}

TEST_CASE("faceted: one observation of a bar the rig calls square is measured, with intervals that say how little") {
  const Session session = observe_hull(edges_of({}), {.observations = 1, .noise_px = 0.1, .seed = 7});
  const auto m = fused(session, SectionKind::square);
  INFO((m ? "" : m.error().message));
  REQUIRE(m);
  CHECK(m->section_kind == SectionKind::square);
  const WidthErrors errors = width_errors(*m, {300.0, 300.0});
  INFO("rms " << errors.rms << ", largest " << errors.largest << ", covered " << errors.covered);
  CHECK(errors.covered > 0.8);
  CHECK(errors.rms < 6.0);
}

TEST_CASE("faceted: a bar one of whose ends two cameras hardly see is told and measured as if they did") {
  Session session = observe_hull(edges_of({}), {.observations = 6, .noise_px = 0.15, .seed = 6});
  for (std::size_t k = 0; k < session.imprints.size(); ++k)
    for (std::size_t c = 0; c < 2; ++c) {
      Imprint& imprint = session.imprints[k][c];
      for (std::size_t i = 0; i < kImprintStations; ++i) {
        const std::size_t from_end = i < kImprintStations / 2 ? i : kImprintStations - 1 - i;
        if (from_end < 120) imprint.axis.weight[i] = (k % 2 == 0 ? imprint.upper : imprint.lower).weight[i] = 0.0;
        if (from_end < 60) (k % 2 == 0 ? imprint.lower : imprint.upper).weight[i] = 0.0;
      }
    }
  const auto m = fused(session);
  REQUIRE(m);
  CHECK(m->section_kind == SectionKind::square);
  CHECK(width_errors(*m, {300.0, 300.0}).rms < 0.5);
  CHECK(m->max_deflection_mm == Approx(8.0).margin(0.5));
}

TEST_CASE("faceted: a round forging stays round, out of round by 5 mm or not") {
  Rod rod = bent_rod();
  make_out_of_round(rod, 5.0, 400.0, 3);
  const auto m = fused(observe(rod, {.observations = 4, .noise_px = 0.1, .seed = 8}));
  REQUIRE(m);
  CHECK(m->section_kind == SectionKind::round);
  CHECK(m->facets.empty());
}

TEST_CASE("faceted: a stepped round forging of which scale hides now the thick, now the thin part changes no width") {
  Session session = observe(stepped_rod(), {.observations = 3, .step_deg = 60.0, .noise_px = 0.1, .seed = 9});
  for (std::size_t k = 0; k < session.imprints.size(); ++k)
    for (Imprint& imprint : session.imprints[k])
      for (std::size_t i = 0; i < kImprintStations; ++i) {
        const bool thick = i > 120 && i < 280;  // of either direction of the stations, most of what is thickest
        if (thick == (k % 2 == 0)) imprint.upper.weight[i] = imprint.lower.weight[i] = 0.0;
      }
  // Two views that share no station say nothing of each other; the first and the third do.
  CHECK(change_of_width(session.imprints) < 0.2 * kRoundestFaceted);
}

}  // namespace imprint
