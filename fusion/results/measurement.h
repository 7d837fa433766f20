#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "fusion/combine/combine.h"

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
  std::string session;
  std::string method;
  std::string geometry = "joint";  ///< fusion/geometry_method.h
  std::string line;     ///< "<site>/<line>"; empty: not measured on a running line
  std::string made_at;  ///< UTC, "2026-11-22T18:05:02.123Z"; empty: not known
  double length_mm = 0.0;
  double length_ci95_mm = 0.0;
  double max_deflection_mm = 0.0;
  double max_deflection_at_mm = 0.0;
  double max_deflection_direction_deg = 0.0;  ///< of (y, z), from y towards z
  Eigen::Matrix3d R_forging_world = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_world_mm = Eigen::Vector3d::Zero();
  std::vector<Section> sections;
  std::vector<Observation> observations;
  std::vector<std::string> warnings;
};

Measurement make_measurement(const CombinedForging& forging, std::vector<Measurement::Observation> observations,
                             std::string session, std::string method);

nlohmann::json to_json(const Measurement& measurement);
Result<Measurement> measurement_from_json(const nlohmann::json& json);

}  // namespace imprint
