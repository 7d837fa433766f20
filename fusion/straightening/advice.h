#pragma once

#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "fusion/results/measurement.h"

namespace imprint {

struct StraighteningConfig {
  double tolerance_mm = 0.0;           ///< of the largest deflection, above 0
  double support_span_mm = 800.0;      ///< between the two supports (the press's own)
  double springback = 1.25;            ///< ram travel under load over what stays bent; learn_springback tells it
  double press_direction_deg = -90.0;  ///< towards which the ram moves, of (y, z) from y to z: down
  double end_margin_mm = 40.0;         ///< supports stand at least so far from either end
  int most_strokes = 3;

  [[nodiscard]] Result<void> validate() const;
};

/// One stroke of three-point bending: two supports below, the ram between them.
struct Stroke {
  double at_mm = 0.0;  ///< of the ram, from the first end
  double support_first_mm = 0.0, support_last_mm = 0.0;
  double turn_deg = 0.0;                     ///< of the forging about x, right-handed, so that the bow meets the ram
  double bend_mm = 0.0;                      ///< that has to stay at the ram, between the supports
  double travel_mm = 0.0;                    ///< of the ram from contact, springback included
  double predicted_max_deflection_mm = 0.0;  ///< after this stroke
};

struct StraighteningAdvice {
  bool action = false;  ///< false: within tolerance, or no stroke would make it straighter
  std::string reason;
  Length max_deflection;  ///< as it is
  std::vector<Stroke> strokes;
  std::vector<Eigen::Vector2d> predicted_axis_mm;  ///< after all strokes, one a section, seen from its own ideal axis
};

/// Where to press: as few strokes as are needed, chosen together so that the least deflection is left. A stroke bends
/// the axis where the ram stands, over one diameter, and leaves what lies outside the supports straight as it was
/// (a plastic hinge); the axis is then seen from its new ideal axis. `end_section_mm` as the rig's. Fails
/// (invalid_input) when the supports do not fit under the forging.
Result<StraighteningAdvice> advise(const Measurement& measurement, double end_section_mm,
                                   const StraighteningConfig& config);

/// A stroke that was made, and how far the axis stayed bent by it.
struct StrokeRecord {
  double travel_mm = 0.0;
  double bend_mm = 0.0;
};

/// The bend that a stroke between these supports has left, from the measurements before and after it: how far the axis
/// at the ram has moved against the line through its places at the supports, along the stroke.
StrokeRecord record_of(const Measurement& before, const Measurement& after, const Stroke& stroke);

/// Travel over bend by least squares through the origin. Fails (job_failed) without a record that bent anything.
Result<double> learn_springback(std::span<const StrokeRecord> records);

nlohmann::json to_json(const StraighteningAdvice& advice);

}  // namespace imprint
