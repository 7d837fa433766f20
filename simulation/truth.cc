#include "simulation/truth.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "simulation/plate_layout.h"
#include "simulation/plate_painter.h"
#include "simulation/props.h"
#include "simulation/silhouette_outline.h"

namespace imprint {
namespace {

using nlohmann::ordered_json;

constexpr double section_step_mm = 1.0;
constexpr int vertices_per_px = 8;

ordered_json numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

ordered_json numbers(const Eigen::Matrix3d& m) {
  ordered_json json = ordered_json::array();
  for (int i = 0; i < 9; ++i) json.push_back(m(i / 3, i % 3));
  return json;
}

// Ten-thousandths of a pixel: a quarter of the file for a twentieth of the truth's own error.
ordered_json pixel(const ObservedPoint& p) { return {std::round(p.x_px * 1e4) / 1e4, std::round(p.y_px * 1e4) / 1e4}; }

ordered_json curve(const std::vector<ObservedPoint>& points) {
  ordered_json json = ordered_json::array();
  for (std::size_t i = 0; i < points.size(); i += vertices_per_px) json.push_back(pixel(points[i]));
  if ((points.size() - 1) % vertices_per_px != 0) json.push_back(pixel(points.back()));
  return json;
}

// Outermost point of an end's arc, seen along the image of the axis from `inside` to `outside`.
ObservedPoint outermost(const std::vector<ObservedPoint>& arc, const ObservedPoint& inside,
                        const ObservedPoint& outside) {
  const double dx = outside.x_px - inside.x_px, dy = outside.y_px - inside.y_px;
  return *std::max_element(arc.begin(), arc.end(), [&](const ObservedPoint& a, const ObservedPoint& b) {
    return a.x_px * dx + a.y_px * dy < b.x_px * dx + b.y_px * dy;
  });
}

std::string_view state_name(PlateState state) {
  switch (state) {
    case PlateState::clean:
      return "clean";
    case PlateState::dirty:
      return "dirty";
    case PlateState::hidden:
      return "hidden";
  }
  return "";
}

ordered_json seen_targets(const Scene& scene, const Layout& layout, std::size_t camera) {
  const CameraModel& model = scene.cameras[camera].model;
  const CameraPose& pose = layout.poses[camera];
  ordered_json json = ordered_json::array();
  for (const Plate& plate : layout.plates) {
    if (!plate_readable(plate, scene.targets.plate_mm, model, pose)) continue;
    const DotImage dot = dot_image(plate, scene.targets.dot_diameter_mm, model, pose);
    json.push_back({{"id", plate.code.id},
                    {"x_px", dot.center.x_px},
                    {"y_px", dot.center.y_px},
                    {"ellipse_x_px", dot.ellipse_center.x_px},
                    {"ellipse_y_px", dot.ellipse_center.y_px},
                    {"dot_diameter_px", dot.diameter_px},
                    {"facing_deg", std::acos(std::min(1.0, plate_facing(plate, pose))) * 180.0 / std::numbers::pi},
                    {"state", state_name(plate.state)}});
  }
  return json;
}

struct AxisPoint {
  double s_mm;
  SectionTruth truth;
};

std::vector<AxisPoint> axis_points(const ForgingBody& body) {
  const int count = static_cast<int>(std::ceil(body.length_mm() / section_step_mm));
  std::vector<AxisPoint> points;
  for (int i = 0; i <= count; ++i) {
    const double x = body.length_mm() * i / count;
    points.push_back({x, section_truth(body.section(x))});
  }
  return points;
}

Result<ordered_json> camera_truth(const Scene& scene, const Layout& layout, const std::vector<AxisPoint>& axis,
                                  std::size_t observation, std::size_t camera) {
  const CameraModel& model = scene.cameras[camera].model;
  const CameraPose& pose = layout.poses[camera];
  const BodyPose& body_pose = layout.body_poses[observation];
  const auto outline = body_outline(layout.body, body_pose, model, pose, 1.0 / vertices_per_px);
  if (!outline) return pass_on(outline.error());
  std::vector<ObservedPoint> axis_image;
  for (const AxisPoint& point : axis) {
    const Eigen::Vector3d p_body(point.s_mm, point.truth.center_mm.x(), point.truth.center_mm.y());
    axis_image.push_back(project(model, pose.cam_from_world(body_pose.world_from_body(p_body))));
  }
  ordered_json json;
  json["id"] = model.id;
  json["center_mm"] = numbers(pose.center_world_mm);
  json["R_cam_world"] = numbers(pose.R_cam_world);
  json["targets"] = seen_targets(scene, layout, camera);
  if (!scene.forging.present) return json;
  const auto props = props_of(scene, layout, static_cast<int>(observation), static_cast<int>(camera));
  json["upper"] = curve(outline->upper);
  json["lower"] = curve(outline->lower);
  json["axis"] = ordered_json::array();
  for (const ObservedPoint& p : axis_image) json["axis"].push_back(pixel(p));
  json["start_px"] = pixel(outermost(outline->first_end, axis_image.back(), axis_image.front()));
  json["end_px"] = pixel(outermost(outline->second_end, axis_image.front(), axis_image.back()));
  if (!props.empty()) {
    json["upper_hidden_mm"] = hidden_ranges_mm(props, outline->upper, layout.body.length_mm());
    json["lower_hidden_mm"] = hidden_ranges_mm(props, outline->lower, layout.body.length_mm());
  }
  return json;
}

void add_sections(const Layout& layout, const std::vector<AxisPoint>& axis, ordered_json& json) {
  const BodyPose& pose = layout.body_poses.front();
  const Eigen::Matrix3d R_forging_body = forging_frame(pose).R_forging_world * pose.R_world_body;
  double largest = 0.0;
  ordered_json sections = ordered_json::array();
  for (const AxisPoint& point : axis) {
    const Eigen::Vector3d p =
        R_forging_body * Eigen::Vector3d(point.s_mm, point.truth.center_mm.x(), point.truth.center_mm.y());
    const double deflection = point.truth.center_mm.norm();
    largest = std::max(largest, deflection);
    sections.push_back({{"s_mm", point.s_mm},
                        {"axis_mm", numbers(p)},
                        {"deflection_mm", deflection},
                        {"diameter_mm", point.truth.diameter_mm},
                        {"circularity_mm", point.truth.circularity_mm}});
    if (!point.truth.widths_mm.empty()) sections.back()["widths_mm"] = point.truth.widths_mm;
  }
  json["max_deflection_mm"] = largest;
  json["sections"] = std::move(sections);
}

}  // namespace

ForgingFrame forging_frame(const BodyPose& pose) {
  const Eigen::Vector3d x = pose.R_world_body.col(0);
  constexpr double cos_10_deg = 0.984807753012208;
  const Eigen::Vector3d up = std::abs(x.z()) > cos_10_deg ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d z = (up - x * x.dot(up)).normalized();
  ForgingFrame frame;
  frame.R_forging_world << x.transpose(), z.cross(x).transpose(), z.transpose();
  frame.origin_world_mm = pose.origin_world_mm;
  return frame;
}

Result<std::string> truth_json(const Scene& scene, const Layout& layout) {
  const auto axis = axis_points(layout.body);
  ordered_json json;
  json["schema"] = "imprint.truth/1";
  json["scene"] = scene.name;
  json["seed"] = scene.seed;
  if (!scene.forging.present) json["present"] = false;
  json["length_mm"] = layout.body.length_mm();
  json["end_section_mm"] = scene.spec.end_section_mm;
  add_sections(layout, axis, json);
  json["observations"] = ordered_json::array();
  for (std::size_t i = 0; i < layout.body_poses.size(); ++i) {
    const BodyPose& pose = layout.body_poses[i];
    const ForgingFrame frame = forging_frame(pose);
    ordered_json observation{{"index", i},
                             {"rotation_deg", scene.observations.rotations_deg[i]},
                             {"true_rotation_deg", pose.true_rotation_deg},
                             {"shift_mm", numbers(pose.shift_mm)},
                             {"R_forging_world", numbers(frame.R_forging_world)},
                             {"origin_world_mm", numbers(frame.origin_world_mm)},
                             {"cameras", ordered_json::array()}};
    for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
      auto camera = camera_truth(scene, layout, axis, i, c);
      if (!camera) return pass_on(camera.error());
      observation["cameras"].push_back(std::move(*camera));
    }
    json["observations"].push_back(std::move(observation));
  }
  return json.dump() + "\n";
}

}  // namespace imprint
