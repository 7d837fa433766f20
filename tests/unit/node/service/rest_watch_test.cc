#include "node/service/rest_watch.h"

#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

using std::chrono::milliseconds;

RestWatch::Time at(int ms) { return RestWatch::Time(milliseconds(ms)); }

// A level forging of 600 px with straight rims, moved by so much across and along.
Segmentation forging(double across_px, double along_px = 0.0) {
  Segmentation seen;
  seen.origin = {500.0 + along_px, 400.0 + across_px};
  seen.first_station_px = -300;
  seen.upper_offset_px.assign(600, -80.0F);
  seen.lower_offset_px.assign(600, 80.0F);
  return seen;
}

RestConfig config() {
  RestConfig config;
  config.max_motion_px = 2.0;
  config.hold_s = 1.0;
  config.rearm_px = 10.0;
  return config;
}

// Looks every 250 ms at one place; how often it came to rest.
int looks(RestWatch& watch, const std::optional<Segmentation>& seen, int from_ms, int to_ms) {
  int rests = 0;
  for (int ms = from_ms; ms < to_ms; ms += 250) rests += watch.note(seen, at(ms)) ? 1 : 0;
  return rests;
}

}  // namespace

TEST_CASE("rest: motion is that of the edges, whichever line each look laid through the forging") {
  REQUIRE(edge_motion_px(forging(0.0), forging(0.0)) == Approx(0.0).margin(1e-9));
  REQUIRE(edge_motion_px(forging(0.0), forging(5.0)) == Approx(5.0));
  REQUIRE(edge_motion_px(forging(0.0), forging(0.0, 7.0)) == Approx(7.0));  // pushed along its axis
  Segmentation other_line = forging(3.0);
  other_line.upper_offset_px.assign(600, -83.0F);
  other_line.lower_offset_px.assign(600, 77.0F);
  REQUIRE(edge_motion_px(forging(0.0), other_line) == Approx(0.0).margin(1e-6));
  Segmentation turned = forging(0.0);
  turned.direction_x = std::cos(0.01);
  turned.direction_y = std::sin(0.01);
  REQUIRE(edge_motion_px(forging(0.0), turned).value() > 2.5);  // an end swings by 3 px
}

TEST_CASE("rest: without rims in common there is no motion to tell") {
  Segmentation hidden = forging(0.0);
  hidden.upper_offset_px.assign(600, std::numeric_limits<float>::quiet_NaN());
  REQUIRE_FALSE(edge_motion_px(forging(0.0), hidden));
  REQUIRE_FALSE(edge_motion_px(hidden, forging(0.0)));
  REQUIRE_FALSE(edge_motion_px(forging(0.0), Segmentation{}));
}

TEST_CASE("rest: a forging that is put down and stands for the hold time comes to rest once") {
  RestWatch watch(config());
  REQUIRE(looks(watch, std::nullopt, 0, 1000) == 0);
  for (int i = 0; i < 8; ++i) REQUIRE_FALSE(watch.note(forging(100.0 - 12.0 * i), at(1000 + 250 * i)));
  REQUIRE(looks(watch, forging(4.0), 3000, 4000) == 0);
  REQUIRE(watch.note(forging(4.5), at(4000)));
  REQUIRE(looks(watch, forging(4.5), 4250, 20000) == 0);
}

TEST_CASE("rest: a creep within the limit from look to look is no rest") {
  RestWatch watch(config());
  REQUIRE(looks(watch, std::nullopt, 0, 1500) == 0);
  int rests = 0;
  for (int i = 0; i < 100; ++i) rests += watch.note(forging(1.5 * i), at(1500 + 250 * i)) ? 1 : 0;
  REQUIRE(rests == 0);
}

TEST_CASE("rest: what lay there from the first look has not come to rest, until it has moved") {
  RestWatch watch(config());
  REQUIRE(looks(watch, forging(0.0), 0, 5000) == 0);
  REQUIRE_FALSE(watch.note(forging(30.0), at(5000)));
  REQUIRE(looks(watch, forging(0.0), 5250, 7000) == 1);
}

TEST_CASE("rest: a forging hidden for a moment is at the same rest, one taken away and put back at another") {
  RestWatch watch(config());
  REQUIRE(looks(watch, std::nullopt, 0, 1500) == 0);
  REQUIRE(looks(watch, forging(0.0), 1500, 4000) == 1);
  REQUIRE(looks(watch, std::nullopt, 4000, 4500) == 0);
  REQUIRE(looks(watch, forging(0.0), 4500, 8000) == 0);
  REQUIRE(looks(watch, std::nullopt, 8000, 9500) == 0);
  REQUIRE(looks(watch, forging(0.0), 9500, 12000) == 1);
}

TEST_CASE("rest: a nudge below the limit to come to rest again fires nothing") {
  RestWatch watch(config());
  REQUIRE(looks(watch, std::nullopt, 0, 1500) == 0);
  REQUIRE(looks(watch, forging(0.0), 1500, 4000) == 1);
  REQUIRE(looks(watch, forging(6.0), 4000, 8000) == 0);
  REQUIRE(looks(watch, forging(12.0), 8000, 12000) == 1);
}

TEST_CASE("rest: limits that contradict each other are refused") {
  RestConfig bad = config();
  bad.rearm_px = 1.0;
  REQUIRE(bad.validate().error().message.find("rearm_px: expected more than max_motion_px (2)") != std::string::npos);
  bad = config();
  bad.period_ms = 1.0;
  REQUIRE_FALSE(bad.validate());
}

}  // namespace imprint
