#include "node/edge/outside_level.h"

#include <cmath>
#include <numbers>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

constexpr double kEdge = 15.3, kBlur = 0.9, kBackground = 0.04, kBody = 0.24;

// A straight rim at kEdge of a body, and a strip of `width_px` beside it on the side given (-1 outside, 1 inside) that
// is `raised` (share of the step from background to body) above what would be there.
ScanLines rim(int side, double width_px, double raised) {
  ScanLines scan;
  for (int n = 0; n < 40; ++n) {
    ScanLine line;
    line.index = n, line.begin = scan.values.size(), line.count = 32;
    for (int i = 0; i < line.count; ++i) {
      const auto step = [&](double at) { return 0.5 * std::erfc(-(i - at) / kBlur / std::numbers::sqrt2); };
      const double strip = side < 0 ? step(kEdge - width_px) - step(kEdge) : step(kEdge) - step(kEdge + width_px);
      scan.values.push_back(static_cast<float>(kBackground + (kBody - kBackground) * (step(kEdge) + raised * strip)));
    }
    scan.lines.push_back(line);
  }
  return scan;
}

OutsideLevel level_of(const ScanLines& scan, double step) {
  std::vector<StepEdge> edges;
  for (std::size_t n = 0; n < scan.lines.size(); ++n) edges.push_back({n, kEdge, 0.02, step, kBlur});
  return outside_levels(scan, edges)[20];
}

}  // namespace

TEST_CASE("outside level: a clean rim has neither dip nor bump nor ledge") {
  const OutsideLevel level = level_of(rim(1, 3.0, 0.0), kBody - kBackground);
  CHECK(std::abs(level.dip) < 1e-3);
  CHECK(std::abs(level.bump) < 1e-3);
  CHECK(std::abs(level.ledge) < 1e-3);
}

TEST_CASE("outside level: a strip outside is a dip or a bump, a half-bright one inside a ledge") {
  const double whole = kBody - kBackground;
  CHECK(level_of(rim(-1, 4.0, -0.2), whole).dip > 0.15);
  CHECK(level_of(rim(-1, 4.0, 0.2), whole).bump > 0.15);
  const OutsideLevel beam = level_of(rim(1, 4.0, -0.5), 0.5 * whole);  // it hugs the rim: its outer edge was taken
  CHECK(beam.ledge > 0.8);
  CHECK(beam.bump < 0.05);
}

}  // namespace imprint
