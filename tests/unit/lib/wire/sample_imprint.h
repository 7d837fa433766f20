#pragma once

#include <cmath>
#include <random>

#include "lib/geometry/rotation.h"
#include "lib/imprint/imprint.h"

namespace imprint::test {

/// What the curves of a sample look like.
struct CurveShape {
  double noise_px = 0.3;  ///< normal, independent from station to station
  double bow_px = 25.0;
  int steps = 3;               ///< changes of section, up to +-120 px each
  double untrusted = 0.05;     ///< share of weight 0
  bool random_weights = true;  ///< uniform in 0..1; otherwise runs of 1 with soft borders
};

inline ImprintCurve sample_curve(std::mt19937& random, const CurveShape& shape, double middle_px,
                                 std::size_t stations) {
  std::normal_distribution<double> noise(0.0, shape.noise_px > 0.0 ? shape.noise_px : 1e-12);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  ImprintCurve curve;
  double level_px = middle_px;
  for (std::size_t i = 0; i < stations; ++i) {
    if (unit(random) < shape.steps / static_cast<double>(stations)) level_px += 240.0 * (unit(random) - 0.5);
    const double s = static_cast<double>(i) / static_cast<double>(stations);
    curve.offset_px.push_back(level_px + shape.bow_px * std::sin(3.0 * s) + noise(random));
    const double weight = shape.random_weights ? unit(random) : std::min(1.0, 0.2 + 30.0 * s);
    curve.weight.push_back(unit(random) < shape.untrusted ? 0.0 : weight);
  }
  return curve;
}

/// A valid imprint with every field set.
inline Imprint sample_imprint(std::mt19937& random, const CurveShape& shape = {},
                              std::size_t stations = kImprintStations) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Imprint imprint;
  imprint.camera_id = "cam2";
  imprint.session = "2026-11-22_heat-0417";
  imprint.observation = 2;
  imprint.rotation_deg = 90.0;
  imprint.boot_id = random() | std::uint64_t{random()} << 32;
  imprint.sequence = 4711;
  imprint.sensor_time_ns = 1795370000123456789;
  imprint.focal_length_px = 5722.79;
  imprint.pose.R_cam_world = rotation_from_vector({2.0 * unit(random), unit(random) - 3.0, unit(random)});
  imprint.pose.center_world_mm = {1234.5 * unit(random), -4321.0, 987.6};
  Matrix6d half;
  for (int i = 0; i < 36; ++i) half(i / 6, i % 6) = (unit(random) - 0.5) * (i / 6 < 3 ? 0.3 : 1e-4);
  imprint.pose.covariance = half * half.transpose();
  const double tilt = 0.02 * unit(random);
  imprint.grid = {{-31.25, 17.5}, std::cos(tilt), std::sin(tilt), -2103.0, 8.4251};
  imprint.upper = sample_curve(random, shape, -170.0, stations);
  imprint.lower = sample_curve(random, shape, 165.0, stations);
  imprint.axis = sample_curve(random, shape, -2.0, stations);
  imprint.start = {-2098.3, -1.5, 0.07, true};
  imprint.end = {2087.1, 3.25, 0.11, false};
  imprint.quality = {31, 28, 0.127, 8421, 0.93, 0.41, 0.002, 0.0004, 0.79, 0.83, 0.14};
  imprint.method = "best";
  imprint.warnings = {"targets 17, 33: partly hidden, left out", "scale at the rim between stations 120 and 140"};
  return imprint;
}

}  // namespace imprint::test
