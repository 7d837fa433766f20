#include "fusion/results/measurement.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace imprint {
namespace {

constexpr const char* kSchema = "imprint.result/1";
constexpr double kCi95 = 1.959964;  // standard deviations of a normal value

/// Radius of the circle about the measured axis point that holds the true one with 95 %. Between a line (1.960 sigma)
/// and a round cloud (2.448 sigma) the fit is good to 0.5 %.
double axis_ci95_mm(const Eigen::Matrix2d& covariance) {
  const Eigen::Vector2d variances =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance, Eigen::EigenvaluesOnly).eigenvalues();
  const double larger = std::sqrt(std::max(variances(1), 0.0));
  const double smaller = std::sqrt(std::max(variances(0), 0.0));
  if (!(larger > 0.0)) return 0.0;
  return larger * (kCi95 + 0.4878 * std::pow(smaller / larger, 2.7));
}

nlohmann::json section_to_json(const Measurement::Section& section) {
  return {{"s_mm", section.s_mm},
          {"axis_mm", {section.axis_mm[0], section.axis_mm[1], section.axis_mm[2]}},
          {"deflection_mm", section.deflection_mm},
          {"diameter_mm", section.diameter_mm},
          {"circularity_mm", section.circularity_mm},
          {"axis_ci95_mm", section.axis_ci95_mm},
          {"diameter_ci95_mm", section.diameter_ci95_mm},
          {"circularity_ci95_mm", section.circularity_ci95_mm}};
}

nlohmann::json matrix_to_json(const Eigen::Matrix3d& R) {
  nlohmann::json numbers = nlohmann::json::array();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) numbers.push_back(R(i, j));
  return numbers;
}

nlohmann::json vector_to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::json camera_to_json(const CameraShare& camera) {
  nlohmann::json json = {{"id", camera.id},
                         {"center_mm", vector_to_json(camera.pose.center_world_mm)},
                         {"R_cam_world", matrix_to_json(camera.pose.R_cam_world)},
                         {"reprojection_rms_px", camera.reprojection_rms_px},
                         {"targets_used", camera.targets_used},
                         {"edge_points", camera.edge_points},
                         {"excluded", camera.excluded},
                         {"pose_state", pose_state_name(camera.pose_state)},
                         {"pose_doubtful", camera.pose_doubtful}};
  if (!camera.reason.empty()) json["reason"] = camera.reason;
  return json;
}

// Reading: nlohmann throws on a missing key or a wrong type; measurement_from_json stops that.

Eigen::Vector3d vector_from_json(const nlohmann::json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

Eigen::Matrix3d matrix_from_json(const nlohmann::json& json) {
  Eigen::Matrix3d R;
  for (std::size_t i = 0; i < 9; ++i) R(static_cast<int>(i / 3), static_cast<int>(i % 3)) = json.at(i).get<double>();
  return R;
}

Measurement::Section section_from_json(const nlohmann::json& json) {
  const Eigen::Vector3d axis = vector_from_json(json.at("axis_mm"));
  return {.s_mm = json.at("s_mm").get<double>(),
          .axis_mm = {axis.x(), axis.y(), axis.z()},
          .deflection_mm = json.at("deflection_mm").get<double>(),
          .diameter_mm = json.at("diameter_mm").get<double>(),
          .circularity_mm = json.at("circularity_mm").get<double>(),
          .axis_ci95_mm = json.at("axis_ci95_mm").get<double>(),
          .diameter_ci95_mm = json.at("diameter_ci95_mm").get<double>(),
          .circularity_ci95_mm = json.at("circularity_ci95_mm").get<double>()};
}

CameraShare camera_from_json(const nlohmann::json& json) {
  CameraShare camera;
  camera.id = json.at("id").get<std::string>();
  camera.pose.center_world_mm = vector_from_json(json.at("center_mm"));
  camera.pose.R_cam_world = matrix_from_json(json.at("R_cam_world"));
  camera.reprojection_rms_px = json.at("reprojection_rms_px").get<double>();
  camera.targets_used = json.at("targets_used").get<int>();
  camera.edge_points = json.at("edge_points").get<int>();
  camera.excluded = json.at("excluded").get<bool>();
  camera.reason = json.value("reason", "");
  camera.pose_state = pose_state_from(std::string_view(json.value("pose_state", std::string())));
  camera.pose_doubtful = json.value("pose_doubtful", false);
  return camera;
}

}  // namespace

Measurement make_measurement(const CombinedForging& forging, std::vector<Measurement::Observation> observations,
                             std::string session, std::string method) {
  Measurement measurement;
  measurement.session = std::move(session);
  measurement.method = std::move(method);
  measurement.length_mm = forging.length_mm;
  measurement.length_ci95_mm = kCi95 * forging.length_sigma_mm;
  measurement.R_forging_world = forging.R_forging_world;
  measurement.origin_world_mm = forging.origin_world_mm;
  measurement.observations = std::move(observations);
  measurement.warnings = forging.warnings;
  for (const CombinedSection& from : forging.sections) {
    Measurement::Section section{};
    section.s_mm = from.s_mm;
    for (int i = 0; i < 3; ++i) section.axis_mm[i] = from.axis_mm(i);
    section.deflection_mm = std::hypot(from.axis_mm.y(), from.axis_mm.z());
    section.diameter_mm = from.diameter_mm;
    section.circularity_mm = from.circularity_mm;
    section.axis_ci95_mm = axis_ci95_mm(from.axis_covariance_mm2);
    section.diameter_ci95_mm = kCi95 * from.diameter_sigma_mm;
    section.circularity_ci95_mm = kCi95 * from.circularity_sigma_mm;
    if (measurement.sections.empty() || section.deflection_mm > measurement.max_deflection_mm) {
      measurement.max_deflection_mm = section.deflection_mm;
      measurement.max_deflection_at_mm = section.s_mm;
      measurement.max_deflection_direction_deg = std::atan2(from.axis_mm.z(), from.axis_mm.y()) * 180.0 / M_PI;
    }
    measurement.sections.push_back(section);
  }
  return measurement;
}

nlohmann::json to_json(const Measurement& measurement) {
  nlohmann::json json;
  json["schema"] = kSchema;
  json["session"] = measurement.session;
  json["method"] = measurement.method;
  json["geometry"] = measurement.geometry;
  if (!measurement.line.empty()) json["line"] = measurement.line;
  if (!measurement.made_at.empty()) json["made_at"] = measurement.made_at;
  json["length_mm"] = measurement.length_mm;
  json["length_ci95_mm"] = measurement.length_ci95_mm;
  json["max_deflection_mm"] = measurement.max_deflection_mm;
  json["max_deflection_at_mm"] = measurement.max_deflection_at_mm;
  json["max_deflection_direction_deg"] = measurement.max_deflection_direction_deg;
  json["alignment"] = {{"R_forging_world", matrix_to_json(measurement.R_forging_world)},
                       {"origin_world_mm", vector_to_json(measurement.origin_world_mm)}};
  json["sections"] = nlohmann::json::array();
  for (const Measurement::Section& section : measurement.sections) json["sections"].push_back(section_to_json(section));
  json["observations"] = nlohmann::json::array();
  for (const Measurement::Observation& observation : measurement.observations) {
    nlohmann::json cameras = nlohmann::json::array();
    for (const CameraShare& camera : observation.cameras) cameras.push_back(camera_to_json(camera));
    json["observations"].push_back(
        {{"index", observation.index}, {"rotation_deg", observation.rotation_deg}, {"cameras", cameras}});
  }
  json["warnings"] = measurement.warnings;
  return json;
}

Result<Measurement> measurement_from_json(const nlohmann::json& json) {
  try {
    if (const std::string schema = json.at("schema").get<std::string>(); schema != kSchema)
      return invalid_input("result: schema {} expected, found {}", kSchema, schema);
    Measurement measurement;
    measurement.session = json.value("session", "");
    measurement.method = json.at("method").get<std::string>();
    measurement.geometry = json.value("geometry", "joint");
    measurement.line = json.value("line", "");
    measurement.made_at = json.value("made_at", "");
    measurement.length_mm = json.at("length_mm").get<double>();
    measurement.length_ci95_mm = json.value("length_ci95_mm", 0.0);
    measurement.max_deflection_mm = json.at("max_deflection_mm").get<double>();
    measurement.max_deflection_at_mm = json.at("max_deflection_at_mm").get<double>();
    measurement.max_deflection_direction_deg = json.at("max_deflection_direction_deg").get<double>();
    measurement.R_forging_world = matrix_from_json(json.at("alignment").at("R_forging_world"));
    measurement.origin_world_mm = vector_from_json(json.at("alignment").at("origin_world_mm"));
    for (const nlohmann::json& section : json.at("sections"))
      measurement.sections.push_back(section_from_json(section));
    for (const nlohmann::json& from : json.at("observations")) {
      Measurement::Observation observation;
      observation.index = from.at("index").get<int>();
      observation.rotation_deg = from.at("rotation_deg").get<double>();
      for (const nlohmann::json& camera : from.at("cameras")) observation.cameras.push_back(camera_from_json(camera));
      measurement.observations.push_back(std::move(observation));
    }
    measurement.warnings = json.at("warnings").get<std::vector<std::string>>();
    return measurement;
  } catch (const nlohmann::json::exception& fault) {
    return invalid_input("result: not a document of {}: {}", kSchema, fault.what());
  }
}

}  // namespace imprint
