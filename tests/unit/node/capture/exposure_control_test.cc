#include "node/capture/exposure_control.h"

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

using Catch::Matchers::Contains;

// What a linear sensor shows of a body whose 99.5 percentile would be `level` at 1000 us and 0 dB, half as bright on
// the whole.
BodyLight seen(double level, const Exposure& exposure) {
  const double brightest = level * exposure.time_us / 1000.0 * std::pow(10.0, exposure.gain_db / 20.0);
  return {std::min(1.0, brightest), std::clamp((brightest - 1.0) / (0.5 * brightest), 0.0, 1.0)};
}

struct Course {
  Exposure exposure{1000.0, 0.0};
  std::string alarm;
  int changes = 0;
};

Course course_of(double level, const ExposureConfig& config, int frames) {
  Course course;
  for (int i = 0; i < frames; ++i) {
    const auto decision = next_exposure(config, course.exposure, seen(level, course.exposure));
    course.exposure = decision.next, course.alarm = decision.alarm, course.changes += decision.changed;
  }
  return course;
}

}  // namespace

TEST_CASE("exposure: bodies from 16 times too dark to 50 times too bright come near the target within five frames") {
  for (const double level : {0.05, 0.1, 0.4, 0.8, 1.0, 1.3, 2.4, 8.0, 40.0}) {
    const Course course = course_of(level, {}, 5);
    const BodyLight light = seen(level, course.exposure);
    INFO("level " << level << " ends at " << light.level << " with " << course.exposure.time_us << " us");
    CHECK_FALSE(is_saturated(light));
    CHECK(light.level >= 0.4);
    CHECK(light.level <= 0.92);
    CHECK(course.alarm.empty());
    CHECK(course.exposure.gain_db == 0.0);
  }
}

TEST_CASE("exposure: near the target nothing changes, and once there it stays") {
  for (const double level : {0.45, 0.6, 0.8, 0.9}) CHECK(course_of(level, {}, 3).changes == 0);
  for (const double level : {0.35, 0.95}) CHECK(course_of(level, {}, 10).changes == 1);
}

TEST_CASE("exposure: no step is larger than max_step") {
  ExposureConfig config;
  config.max_step = 2.0;
  CHECK(next_exposure(config, {1000.0, 0.0}, {1.0, 0.9}).next.time_us == Approx(500.0));
  CHECK(next_exposure(config, {1000.0, 0.0}, {0.1, 0.0}).next.time_us == Approx(2000.0));
}

TEST_CASE("exposure: gain comes after the longest time and goes first") {
  ExposureConfig config;
  config.max_time_us = 2000.0, config.max_gain_db = 12.0;
  const Course dark = course_of(0.2, config, 5);
  CHECK(dark.exposure.time_us == Approx(2000.0));
  CHECK(dark.exposure.gain_db == Approx(20.0 * std::log10(2.0)).epsilon(0.01));
  const auto brighter = next_exposure(config, {2000.0, 12.0}, {1.0, 0.9});
  CHECK(brighter.next.gain_db < 0.1);  // a quarter of 2000 us at 12 dB is 1990 us
  CHECK(brighter.next.time_us > 1980.0);
}

TEST_CASE("exposure: a body too bright for the shortest time, or too dark for the longest, is an alarm") {
  ExposureConfig config;
  const Course bright = course_of(100.0, config, 10);
  CHECK(bright.exposure.time_us == Approx(20.0));
  CHECK(bright.alarm == "cannot hold the body out of saturation: exposure at its minimum 20 us");
  config.max_time_us = 1000.0;
  const Course dark = course_of(0.1, config, 5);
  CHECK_THAT(dark.alarm, Contains("10 % of full scale") && Contains("maximum 1000 us"));
  CHECK(course_of(0.3, config, 5).alarm.empty());  // dark, but to be measured
  CHECK(course_of(45.0, {}, 10).alarm.empty());    // 0.9 at the shortest: it does not saturate
}

TEST_CASE("exposure: without a forging or a known exposure nothing is done") {
  CHECK_FALSE(next_exposure({}, {1000.0, 0.0}, {0.0, 0.0}).changed);
  CHECK_FALSE(next_exposure({}, {0.0, 0.0}, {1.0, 0.9}).changed);
  CHECK(next_exposure({}, {0.0, 0.0}, {1.0, 0.9}).alarm.empty());
}

TEST_CASE("exposure: a time of the camera's beyond the limits is brought within them") {
  CHECK(next_exposure({}, {50'000.0, 0.0}, {1.0, 0.1}).next.time_us == Approx(20'000.0));
  CHECK(ExposureConfig{}.validate());
  ExposureConfig config;
  config.min_time_us = 30'000.0;
  CHECK_THAT(config.validate().error().message, Contains("min_us"));
}

}  // namespace imprint
