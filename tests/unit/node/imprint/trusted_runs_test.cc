#include "node/imprint/trusted_runs.h"

#include <functional>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

constexpr int kLength = 1500, kFrom = 700, kTo = 730;

// An upper rim at -90 px, trusted but for 100 stations on either side of an island [kFrom, kTo) that lies elsewhere.
RimCurve rim_with_island(const std::function<double(double)>& offset_px, int gap = 100) {
  RimCurve curve;
  for (int s = 0; s < kLength; ++s) {
    const bool on_island = s >= kFrom && s < kTo;
    const bool in_gap = !on_island && s >= kFrom - gap && s < kTo + gap;
    curve.push_back({static_cast<double>(s), on_island ? offset_px(s - kFrom) : -90.0, in_gap ? 0.0 : 0.8});
  }
  return curve;
}

int trusted(const RimCurve& curve, int from, int to) {
  int count = 0;
  for (int s = from; s < to; ++s) count += curve[static_cast<std::size_t>(s)].weight > 0;
  return count;
}

}  // namespace

TEST_CASE("trusted runs: short ones go, others stay") {
  RimCurve curve = rim_with_island([](double) { return -90.0; });
  drop_short_runs(curve, kTo - kFrom);
  CHECK(trusted(curve, kFrom, kTo) == kTo - kFrom);
  drop_short_runs(curve, kTo - kFrom + 1);
  CHECK(trusted(curve, kFrom, kTo) == 0);
  CHECK(trusted(curve, 0, 600) == 600);
}

TEST_CASE("trusted runs: an island that leans or lies further in than both sides is no rim, nor are its samples") {
  for (const bool leans : {true, false}) {
    RimCurve curve = rim_with_island([&](double s) { return leans ? -95.0 + 0.3 * s : -60.0; }), samples = curve;
    drop_islands(curve, 1.0, samples);
    CHECK(trusted(curve, kFrom, kTo) == 0);
    CHECK(trusted(samples, kFrom, kTo) == 0);
    CHECK(trusted(curve, 0, 600) == 600);
    CHECK(trusted(samples, 900, kLength) == kLength - 900);
  }
}

TEST_CASE("trusted runs: an island in line, further out, or that its neighbours run into stays") {
  for (const double offset : {-90.0, -88.0, -120.0}) {
    RimCurve curve = rim_with_island([&](double) { return offset; }), samples = curve;
    drop_islands(curve, 1.0, samples);
    CHECK(trusted(curve, kFrom, kTo) == kTo - kFrom);
  }
  RimCurve groove = rim_with_island([](double) { return -60.0; }, 20), samples = groove;
  drop_islands(groove, 1.0, samples);
  CHECK(trusted(groove, kFrom, kTo) == kTo - kFrom);
}

TEST_CASE("trusted runs: where the edge jumps within a few stations two stretches are not one") {
  RimCurve curve = rim_with_island([](double) { return -40.0; }, 5), samples = curve;
  drop_islands(curve, 1.0, samples);
  CHECK(trusted(curve, kFrom, kTo) == 0);
}

TEST_CASE("trusted runs: nothing and nothing trusted are left as they are") {
  RimCurve none, samples;
  drop_islands(none, 1.0, samples);
  CHECK(none.empty());
  RimCurve untrusted = rim_with_island([](double) { return -90.0; });
  for (CurveSample& s : untrusted) s.weight = 0.0;
  samples = untrusted;
  drop_islands(untrusted, -1.0, samples);
  CHECK(trusted(untrusted, 0, kLength) == 0);
}

}  // namespace imprint
