#include <algorithm>

#include <nlohmann/json.hpp>

#include "fusion/results/measurement.h"

namespace imprint {
namespace {

constexpr const char* kSchema = "imprint.result/1";
constexpr double kCi95 = 1.959964;  // standard deviations of a normal value

void put(nlohmann::json& json, const std::string& name, const Length& length) {
  json[name + "_mm"] = length.mm;
  json[name + "_ci95_mm"] = length.ci95_mm;
}

Length length_from(const nlohmann::json& json, const std::string& name) {
  return {json.value(name + "_mm", 0.0), json.value(name + "_ci95_mm", 0.0)};
}

nlohmann::json straightness_to_json(const Straightness& straightness) {
  nlohmann::json json = {{"max_deflection_at_mm", straightness.max_deflection_at_mm},
                         {"max_deflection_direction_deg", straightness.max_deflection_direction_deg}};
  put(json, "max_deflection", straightness.max_deflection);
  put(json, "total_indicator", straightness.total_indicator);
  put(json, "per_metre", straightness.per_metre);
  put(json, "minimum_zone", straightness.minimum_zone);
  return json;
}

Straightness straightness_from_json(const nlohmann::json& json) {
  return {.max_deflection = length_from(json, "max_deflection"),
          .max_deflection_at_mm = json.value("max_deflection_at_mm", 0.0),
          .max_deflection_direction_deg = json.value("max_deflection_direction_deg", 0.0),
          .total_indicator = length_from(json, "total_indicator"),
          .per_metre = length_from(json, "per_metre"),
          .minimum_zone = length_from(json, "minimum_zone")};
}

nlohmann::json diameters_to_json(const Diameters& diameters) {
  nlohmann::json json = {{"min_at_mm", diameters.smallest_at_mm}, {"max_at_mm", diameters.largest_at_mm}};
  put(json, "mean", diameters.mean);
  put(json, "min", diameters.smallest);
  put(json, "max", diameters.largest);
  return json;
}

Diameters diameters_from_json(const nlohmann::json& json) {
  return {.mean = length_from(json, "mean"),
          .smallest = length_from(json, "min"),
          .largest = length_from(json, "max"),
          .smallest_at_mm = json.value("min_at_mm", 0.0),
          .largest_at_mm = json.value("max_at_mm", 0.0)};
}

nlohmann::json sureness_to_json(const Measurement::Sureness& sureness) {
  return {{"axis_ci95_mm", sureness.axis_ci95_mm},
          {"diameter_ci95_mm", sureness.diameter_ci95_mm},
          {"circularity_ci95_mm", sureness.circularity_ci95_mm}};
}

Measurement::Sureness sureness_from_json(const nlohmann::json& json) {
  return {json.at("axis_ci95_mm").get<double>(), json.at("diameter_ci95_mm").get<double>(),
          json.at("circularity_ci95_mm").get<double>()};
}

void put_roundness(nlohmann::json& section, const SectionRoundness& roundness) {
  put(section, "roundness_ls", roundness.least_squares);
  put(section, "roundness_mz", roundness.minimum_zone);
  put(section, "roundness_mc", roundness.minimum_circumscribed);
}

SectionRoundness roundness_from_json(const nlohmann::json& section) {
  return {length_from(section, "roundness_ls"), length_from(section, "roundness_mz"),
          length_from(section, "roundness_mc")};
}

nlohmann::json facet_value_to_json(const SectionFacets::Value& value) {
  return {{"value", value.value}, {"ci95", kCi95 * value.sigma}};
}

nlohmann::json facets_to_json(const SectionFacets& facets) {
  nlohmann::json json = {{"widths_mm", nlohmann::json::array()},
                         {"squareness_deg", facet_value_to_json(facets.squareness_deg)},
                         {"twist_deg", facet_value_to_json(facets.twist_deg)},
                         {"corner_radius_mm", facet_value_to_json(facets.corner_radius_mm)},
                         {"corners_mm", nlohmann::json::array()}};
  for (const SectionFacets::Value& width : facets.widths_mm) json["widths_mm"].push_back(facet_value_to_json(width));
  for (const Eigen::Vector2d& corner : facets.corners_mm) json["corners_mm"].push_back({corner.x(), corner.y()});
  return json;
}

SectionFacets facets_from_json(const nlohmann::json& json) {
  const auto value = [](const nlohmann::json& from) {
    return SectionFacets::Value{from.at("value").get<double>(), from.at("ci95").get<double>() / kCi95};
  };
  SectionFacets facets{.widths_mm = {},
                       .squareness_deg = value(json.at("squareness_deg")),
                       .twist_deg = value(json.at("twist_deg")),
                       .corner_radius_mm = value(json.at("corner_radius_mm")),
                       .corners_mm = {}};
  for (const nlohmann::json& width : json.at("widths_mm")) facets.widths_mm.push_back(value(width));
  for (const nlohmann::json& corner : json.at("corners_mm"))
    facets.corners_mm.emplace_back(corner.at(0).get<double>(), corner.at(1).get<double>());
  return facets;
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

nlohmann::json cooling_to_json(const Cooling& cooling, const Measurement& m) {
  nlohmann::json json = {{"grade", cooling.grade},
                         {"steel", cooling.steel},
                         {"temperature_c", cooling.hot.temperature_c},
                         {"temperature_sigma_c", cooling.hot.temperature_sigma_c},
                         {"temperature_source", cooling.hot.source},
                         {"expansion", cooling.expansion.share},
                         {"expansion_sigma", cooling.expansion.sigma},
                         {"expansion_source", cooling.expansion_source},
                         {"cold_c", kColdC}};
  put(json, "length", cooling.cold({m.length_mm, m.length_ci95_mm}));
  put(json, "max_deflection", cooling.cold(m.straightness.max_deflection));
  put(json, "diameter_mean", cooling.cold(m.diameters.mean));
  put(json, "diameter_min", cooling.cold(m.diameters.smallest));
  put(json, "diameter_max", cooling.cold(m.diameters.largest));
  return json;
}

Cooling cooling_from_json(const nlohmann::json& json) {
  return {.grade = json.at("grade").get<std::string>(),
          .steel = json.at("steel").get<std::string>(),
          .expansion_source = json.at("expansion_source").get<std::string>(),
          .hot = {json.at("temperature_c").get<double>(), json.at("temperature_sigma_c").get<double>(),
                  json.at("temperature_source").get<std::string>()},
          .expansion = {json.at("expansion").get<double>(), json.at("expansion_sigma").get<double>()}};
}

}  // namespace

nlohmann::json to_json(const Measurement& measurement) {
  nlohmann::json json;
  json["schema"] = kSchema;
  json["session"] = measurement.session;
  json["method"] = measurement.method;
  json["geometry"] = measurement.geometry;
  json["section"] = name_of(measurement.section_kind);
  if (!measurement.line.empty()) json["line"] = measurement.line;
  if (!measurement.made_at.empty()) json["made_at"] = measurement.made_at;
  json["length_mm"] = measurement.length_mm;
  json["length_ci95_mm"] = measurement.length_ci95_mm;
  json["max_deflection_mm"] = measurement.max_deflection_mm;
  json["max_deflection_at_mm"] = measurement.max_deflection_at_mm;
  json["max_deflection_direction_deg"] = measurement.max_deflection_direction_deg;
  json["alignment"] = {{"R_forging_world", matrix_to_json(measurement.R_forging_world)},
                       {"origin_world_mm", vector_to_json(measurement.origin_world_mm)}};
  json["straightness"] = straightness_to_json(measurement.straightness);
  json["diameters"] = diameters_to_json(measurement.diameters);
  if (measurement.gain.observations > 0)
    json["gain"] = {{"observations", measurement.gain.observations},
                    {"first_alone", sureness_to_json(measurement.gain.first_alone)},
                    {"all", sureness_to_json(measurement.gain.all)}};
  for (const Measurement::Station& station : measurement.stations) {
    const Measurement::Section section = section_at(measurement, station.s_mm);
    json["diameters"]["stations"].push_back({{"name", station.name},
                                             {"s_mm", station.s_mm},
                                             {"diameter_mm", section.diameter_mm},
                                             {"diameter_ci95_mm", section.diameter_ci95_mm}});
  }
  if (measurement.cooling) json["cold"] = cooling_to_json(*measurement.cooling, measurement);
  json["sections"] = nlohmann::json::array();
  for (std::size_t i = 0; i < measurement.sections.size(); ++i) {
    nlohmann::json section = section_to_json(measurement.sections[i]);
    if (i < measurement.roundness.size()) put_roundness(section, measurement.roundness[i]);
    if (i < measurement.facets.size()) section["facets"] = facets_to_json(measurement.facets[i]);
    json["sections"].push_back(std::move(section));
  }
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
    const auto kind = std::ranges::find(kSectionKinds, json.value("section", "round"));
    if (kind != kSectionKinds.end()) measurement.section_kind = static_cast<SectionKind>(kind - kSectionKinds.begin());
    measurement.line = json.value("line", "");
    measurement.made_at = json.value("made_at", "");
    measurement.length_mm = json.at("length_mm").get<double>();
    measurement.length_ci95_mm = json.value("length_ci95_mm", 0.0);
    measurement.max_deflection_mm = json.at("max_deflection_mm").get<double>();
    measurement.max_deflection_at_mm = json.at("max_deflection_at_mm").get<double>();
    measurement.max_deflection_direction_deg = json.at("max_deflection_direction_deg").get<double>();
    measurement.R_forging_world = matrix_from_json(json.at("alignment").at("R_forging_world"));
    measurement.origin_world_mm = vector_from_json(json.at("alignment").at("origin_world_mm"));
    for (const nlohmann::json& section : json.at("sections")) {
      measurement.sections.push_back(section_from_json(section));
      if (section.contains("roundness_ls_mm")) measurement.roundness.push_back(roundness_from_json(section));
      if (section.contains("facets")) measurement.facets.push_back(facets_from_json(section.at("facets")));
    }
    if (measurement.roundness.size() != measurement.sections.size()) measurement.roundness.clear();
    if (measurement.facets.size() != measurement.sections.size()) measurement.facets.clear();
    if (json.contains("straightness")) measurement.straightness = straightness_from_json(json.at("straightness"));
    if (json.contains("diameters")) measurement.diameters = diameters_from_json(json.at("diameters"));
    if (json.contains("diameters"))
      for (const nlohmann::json& station : json.at("diameters").value("stations", nlohmann::json::array()))
        measurement.stations.push_back({station.at("name").get<std::string>(), station.at("s_mm").get<double>()});
    if (json.contains("cold")) measurement.cooling = cooling_from_json(json.at("cold"));
    if (json.contains("gain")) {
      const nlohmann::json& gain = json.at("gain");
      measurement.gain = {gain.at("observations").get<int>(), sureness_from_json(gain.at("first_alone")),
                          sureness_from_json(gain.at("all"))};
    }
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
