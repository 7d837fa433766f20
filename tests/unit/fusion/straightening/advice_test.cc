#include "fusion/straightening/advice.h"

#include <cmath>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

/// 1900 mm long, 200 mm thick, its axis as given and seen from its ends.
Measurement bar(const auto& yz) {
  Measurement m;
  m.length_mm = 1900.0;
  for (int i = 0; i < 500; ++i) {
    const double s = 1900.0 * i / 499.0;
    const Eigen::Vector2d p = yz(s);
    m.sections.push_back({s, {s, p.x(), p.y()}, p.norm(), 200.0, 0.0, 0.1, 0.1, 0.1});
    m.max_deflection_mm = std::max(m.max_deflection_mm, p.norm());
  }
  return m;
}

/// Bent sharply at 1000 mm by 10 mm, towards `direction_deg`.
Measurement kinked(double direction_deg) {
  const double a = direction_deg * M_PI / 180.0;
  return bar([a](double s) {
    const double height = s < 1000.0 ? s / 100.0 : (1900.0 - s) / 90.0;
    return Eigen::Vector2d(height * std::cos(a), height * std::sin(a));
  });
}

StraighteningConfig config(double tolerance_mm = 1.0) {
  StraighteningConfig config;
  config.tolerance_mm = tolerance_mm;
  return config;
}

}  // namespace

TEST_CASE("straightening: within tolerance there is nothing to do") {
  const auto advice = advise(kinked(90.0), 80.0, config(10.5));
  REQUIRE(advice);
  CHECK_FALSE(advice->action);
  CHECK(advice->strokes.empty());
  CHECK(advice->reason.find("no action") != std::string::npos);
}

TEST_CASE("straightening: a kink is pressed where it is, by what the geometry says, and is gone after") {
  const auto advice = advise(kinked(90.0), 80.0, config());
  REQUIRE(advice);
  REQUIRE(advice->strokes.size() == 1);
  const Stroke& stroke = advice->strokes.front();
  CHECK(stroke.at_mm == Approx(1000.0).margin(25.0));  // every fifth section is tried, 19 mm apart
  CHECK(stroke.support_first_mm == Approx(stroke.at_mm - 400.0));
  CHECK(stroke.support_last_mm == Approx(stroke.at_mm + 400.0));
  // The kink's angle is 1/100 + 1/90; between supports 400 mm either side that is 4.2 mm of sag. A little more leaves
  // less, as an arc of a diameter takes the place of the kink.
  CHECK(stroke.bend_mm == Approx(0.5 * 400.0 * (0.01 + 1.0 / 90.0)).epsilon(0.1));
  CHECK(stroke.travel_mm == Approx(1.25 * stroke.bend_mm));
  CHECK(stroke.predicted_max_deflection_mm < 1.0);  // an arc of a diameter is not a kink
  double largest = 0.0;
  for (const auto& point : advice->predicted_axis_mm) largest = std::max(largest, point.norm());
  CHECK(largest == Approx(stroke.predicted_max_deflection_mm));
}

TEST_CASE("straightening: the forging is turned so that its bow meets the ram") {
  // Bowed towards z, up, and the ram comes down: nothing to turn. Bowed towards y: a quarter turn brings y up.
  const auto up = advise(kinked(90.0), 80.0, config());
  const auto aside = advise(kinked(0.0), 80.0, config());
  const auto sixty = advise(kinked(30.0), 80.0, config());
  REQUIRE((up && aside && sixty));
  CHECK(std::abs(up->strokes[0].turn_deg) < 1.0);
  CHECK(aside->strokes[0].turn_deg == Approx(90.0).margin(1.0));
  CHECK(sixty->strokes[0].turn_deg == Approx(60.0).margin(1.0));
}

TEST_CASE("straightening: a long bow takes more strokes, each leaving less") {
  const auto arc = bar([](double s) { return Eigen::Vector2d(12.0 * std::sin(M_PI * s / 1900.0), 0.0); });
  const auto advice = advise(arc, 80.0, config(0.5));
  REQUIRE(advice);
  REQUIRE(advice->strokes.size() >= 2);
  double before = arc.max_deflection_mm;
  for (const Stroke& stroke : advice->strokes) {
    CHECK(stroke.predicted_max_deflection_mm < before);
    before = stroke.predicted_max_deflection_mm;
  }
  // They are chosen together: the first alone need not be the best one stroke, all of them leave little.
  CHECK(before < 0.1 * arc.max_deflection_mm);
}

TEST_CASE("straightening: springback is learnt from strokes measured before and after") {
  const Measurement before = kinked(90.0);
  Stroke stroke{.at_mm = 1000.0, .support_first_mm = 600.0, .support_last_mm = 1400.0};
  const Measurement straight = bar([](double) { return Eigen::Vector2d(0.0, 0.0); });
  stroke.travel_mm = 6.0;
  stroke.bend_mm = 4.0;
  const StrokeRecord record = record_of(before, straight, stroke);
  CHECK(record.bend_mm == Approx(0.5 * 400.0 * (0.01 + 1.0 / 90.0)).margin(0.05));
  const std::vector<StrokeRecord> records{record, {3.0, 2.1}};
  const auto learnt = learn_springback(records);
  REQUIRE(learnt);
  CHECK(*learnt == Approx((6.0 * record.bend_mm + 3.0 * 2.1) / (record.bend_mm * record.bend_mm + 2.1 * 2.1)));
  CHECK_FALSE(learn_springback({}));
  const std::vector<StrokeRecord> nothing{{5.0, 0.0}};
  CHECK_FALSE(learn_springback(nothing));
}

TEST_CASE("straightening: supports that do not fit, or no tolerance, are refused") {
  StraighteningConfig wide = config();
  wide.support_span_mm = 1850.0;
  CHECK_FALSE(advise(kinked(0.0), 80.0, wide));
  CHECK_FALSE(advise(kinked(0.0), 80.0, StraighteningConfig{}));
}

}  // namespace imprint
