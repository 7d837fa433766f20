#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "fusion/combine/combine.h"
#include "fusion/results/cold.h"
#include "fusion/results/evaluation.h"

namespace imprint {

/// The measured forging: `imprint.result/1` of the contract.
struct Measurement {
  struct Section {
    double s_mm, axis_mm[3], deflection_mm, diameter_mm, circularity_mm;
    double axis_ci95_mm, diameter_ci95_mm, circularity_ci95_mm;
  };
  struct Observation {
    int index = 0;
    double rotation_deg = 0.0;
    std::vector<CameraShare> cameras;
  };
  /// Median half-widths of the sections' 95 % intervals.
  struct Sureness {
    double axis_ci95_mm = 0.0, diameter_ci95_mm = 0.0, circularity_ci95_mm = 0.0;
  };
  /// What it was worth to observe more than once.
  struct Gain {
    int observations = 0;  ///< that could be used; 0: not looked at
    Sureness first_alone, all;
  };
  /// A place along the forging that has a name.
  struct Station {
    std::string name;
    double s_mm = 0.0;
  };
  std::string session;
  std::string method;
  std::string geometry = "joint";  ///< fusion/geometry_method.h
  std::string line;                ///< "<site>/<line>"; empty: not measured on a running line
  std::string made_at;             ///< UTC, "2026-11-22T18:05:02.123Z"; empty: not known
  double length_mm = 0.0;
  double length_ci95_mm = 0.0;
  double max_deflection_mm = 0.0;
  double max_deflection_at_mm = 0.0;
  double max_deflection_direction_deg = 0.0;  ///< of (y, z), from y towards z
  Eigen::Matrix3d R_forging_world = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_world_mm = Eigen::Vector3d::Zero();
  Straightness straightness;
  Diameters diameters;
  std::vector<Section> sections;
  std::vector<SectionRoundness> roundness;  ///< one a section; none where their shapes are not known
  SectionKind section_kind = SectionKind::round;
  std::vector<SectionFacets> facets;  ///< one a section, where they have faces
  std::vector<Station> stations;
  std::optional<Cooling> cooling;  ///< where the temperature is known; all else is of the hot forging
  Gain gain;
  ForgingShape shape;               ///< one a section, while the measurement is at hand: it is not in the file
  std::vector<ForgingShape> draws;  ///< CombinedForging, likewise
  std::vector<Observation> observations;
  std::vector<std::string> warnings;
};

Measurement make_measurement(const CombinedForging& forging, std::vector<Measurement::Observation> observations,
                             std::string session, std::string method);

Measurement::Sureness sureness(const CombinedForging& forging);

/// The section at `s_mm`, on the line between its neighbours, with the wider one's intervals. `measurement` has
/// sections; beyond the ends it is the last one.
Measurement::Section section_at(const Measurement& measurement, double s_mm);

nlohmann::json to_json(const Measurement& measurement);
Result<Measurement> measurement_from_json(const nlohmann::json& json);

}  // namespace imprint
