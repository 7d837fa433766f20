#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include "fusion/combine/alignment.h"
#include "fusion/comparison/cloud_sections.h"
#include "fusion/results/measurement.h"

namespace imprint {

struct CompareConfig {
  double end_section_mm = 80.0;  ///< of the cloud's own ideal axis, as the rig's
  double slice_mm = 6.0;         ///< of a cross-section, along x: twice the point spacing of [D] 2.2.1
  double max_shift_mm = 40.0;    ///< between the ends of result and cloud
  bool same_frame = false;       ///< the cloud is in the rig's world already: nothing is registered but the ideal axis

  [[nodiscard]] Result<void> validate() const;
};

/// One column of [D] table 1: result less cloud.
struct Agreement {
  double overlap = 0.0;  ///< share of the sections in which the 95 % intervals have a point in common
  double mean_mm = 0.0, median_mm = 0.0;
  double rms_mm = 0.0;
};

struct Comparison {
  Agreement axis;  ///< overlap of the axis points in y and z; differences of the deflection
  Agreement diameter, circularity;
  int sections = 0;  ///< that the cloud covers
  int of_sections = 0;
  double turn_deg = 0.0;                       ///< of the cloud about the axis, found
  double shift_mm = 0.0;                       ///< of the cloud along the axis, found
  bool reversed = false;                       ///< the cloud's first end was the result's last
  std::vector<CloudSection> cloud;             ///< in the result's frame
  std::vector<Measurement::Section> measured;  ///< the result's sections beside them
};

/// Registers the cloud (any frame, cropped to the forging; a few stray points do no harm) by its own ideal axis, then
/// along and about it by the diameters and the deflection, cuts the result's sections and compares. Fails (job_failed)
/// when the cloud is no rod like the result's.
Result<Comparison> compare(const Measurement& measurement, std::vector<Eigen::Vector3d> cloud_mm,
                           const CompareConfig& config);

nlohmann::json to_json(const Comparison& comparison);

}  // namespace imprint
