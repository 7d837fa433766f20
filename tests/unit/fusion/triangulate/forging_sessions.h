#pragma once

#include <string>
#include <vector>

#include "fusion/results/measurement.h"
#include "tests/unit/fusion/triangulate/forging_views.h"

namespace imprint::test {

/// One session: what was seen, how the forging was turned, and how it truly lay at first.
struct Session {
  ForgingSpec spec = forge_spec();
  std::vector<std::vector<Imprint>> imprints;  ///< by observation
  std::vector<double> rotations_deg;
  Lying first;
};

/// How a measurement differs from the truth. Axis: distance in y and z, in RMS over the sections.
struct Deviation {
  double axis_rms = 0.0, axis_max = 0.0;
  double diameter_rms = 0.0, diameter_best90_rms = 0.0;
  double circularity_mean = 0.0, circularity_sigma = 0.0;
  double length = 0.0;
  double axis_covered = 0.0, diameter_covered = 0.0, circularity_covered = 0.0;
  double length_in_ci = 0.0;
  double axis_ci95 = 0.0;
  /// Mean square of the errors in half widths of their intervals: 0.26 of a normal value, 0.33 of a round cloud.
  double axis_in_ci = 0.0, diameter_in_ci = 0.0, circularity_in_ci = 0.0;
};

/// Bent into an arc and a little S, round, 260 mm thick and 1900 mm long, times `scale`.
Rod bent_rod(double scale = 1.0, double bow_mm = 8.0);

/// The same with shoulders of 3 mm of diameter per mm, up and down.
Rod stepped_rod();

bool near_shoulder(double x_mm);  ///< of the stepped rod

struct Views {
  int observations = 1;
  double step_deg = 30.0;
  double noise_px = 0.0;
  double scale = 1.0;
  double pose_sigma_mm = 0.0;  ///< and, at the forging, as much again by its rotation
  unsigned seed = 1;
  std::size_t cameras = 3;
};

/// The forge's cameras look at the rod, placed as a manipulator does: to 1 mm, 0.3 deg of tilt and of turn.
Session observe(const Rod& rod, const Views& views);
/// The same of the hull of rods.
Session observe_hull(std::span<const Rod> rods, const Views& views);

/// The edges of a bent forging with `corners` faces whose section is the image of a regular polygon `width_mm` across,
/// `stretch` times as wide along its z, turned by `turn_deg` and twisted by `twist_deg` over the length.
struct FacetedBar {
  int corners = 4;
  double width_mm = 300.0, stretch = 1.0, corner_radius_mm = 25.0, turn_deg = 11.0, twist_deg = 0.0, bow_mm = 8.0;
};
std::vector<Rod> edges_of(const FacetedBar& bar);

/// `measured` has sections; those next to the stepped rod's shoulders may be skipped.
Deviation deviation(const Measurement& measured, const Rod& rod, const Session& session, bool skip_shoulders = false);

std::string text(const Deviation& deviation);

}  // namespace imprint::test
