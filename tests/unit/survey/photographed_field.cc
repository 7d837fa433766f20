#include "tests/unit/survey/photographed_field.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "lib/geometry/rotation.h"

namespace imprint {
namespace {

double uniform(std::mt19937& random, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(random);
}

CameraPose looking(const Eigen::Vector3d& from, const Eigen::Vector3d& at, double roll_rad) {
  const Eigen::Vector3d forward = (at - from).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  CameraPose pose;
  pose.center_world_mm = from;
  pose.R_cam_world << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  pose.R_cam_world = rotation_from_vector({0.0, 0.0, roll_rad}) * pose.R_cam_world;
  return pose;
}

// Every third photograph upright, every third on its other side, as people turn a camera.
double held_roll(int photo, std::mt19937& random) {
  return (photo % 3 - 1) * 0.5 * std::numbers::pi + uniform(random, -0.1, 0.1);
}

// Centroid and mean diameter of the dot's image, from its outline.
DetectedTarget image_of(const PhotographedField& field, const PhotographedField::Target& target,
                        const CameraPose& pose) {
  constexpr int kCorners = 180;
  const Eigen::Vector3d side = target.normal.unitOrthogonal(), up = target.normal.cross(side);
  std::vector<Eigen::Vector2d> outline;
  for (int i = 0; i < kCorners; ++i) {
    const double a = 2.0 * std::numbers::pi * i / kCorners;
    const Eigen::Vector3d p = target.p_mm + field.dot_radius_mm * (std::cos(a) * side + std::sin(a) * up);
    const ObservedPoint at = project(field.camera, pose.cam_from_world(p));
    outline.emplace_back(at.x_px, at.y_px);
  }
  const Eigen::Vector2d base = outline.front();
  double area = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (int i = 0; i < kCorners; ++i) {
    const Eigen::Vector2d a = outline[static_cast<std::size_t>(i)] - base,
                          b = outline[static_cast<std::size_t>((i + 1) % kCorners)] - base;
    const double cross = a.x() * b.y() - a.y() * b.x();
    area += 0.5 * cross;
    moment += cross * (a + b) / 6.0;
  }
  const Eigen::Vector2d centre = moment / area;
  for (int i = 0; i < kCorners; ++i) {
    const Eigen::Vector2d d = outline[static_cast<std::size_t>(i)] - base - centre;
    xx += 2.0 * d.x() * d.x() / kCorners;
    yy += 2.0 * d.y() * d.y() / kCorners;
    xy += 2.0 * d.x() * d.y() / kCorners;
  }
  DetectedTarget result;
  result.center = {base.x() + centre.x(), base.y() + centre.y()};
  result.dot_diameter_px = std::sqrt(xx + yy + 2.0 * std::sqrt(std::max(0.0, xx * yy - xy * xy)));
  return result;
}

}  // namespace

CameraModel reflex_camera() {
  CameraModel camera;
  camera.id = "reflex";
  camera.width_px = 4288;
  camera.height_px = 2848;
  camera.pixel_pitch_um = 5.5;
  camera.focal_length_px = 4412.0;
  camera.principal_point = {2159.3, 1410.8};
  camera.distortion.radial = {-3.1e-2, 4.2e-3, -2.0e-4};
  camera.distortion.tangential = {1.5e-4, -0.9e-4};
  camera.distortion.affine = {0.8e-4, -0.5e-4};
  return camera;
}

PhotographedField large_field(int count, int photos, std::mt19937& random) {
  PhotographedField field;
  field.camera = reflex_camera();
  for (int id = 1; id <= count; ++id) {
    auto& target = field.targets[id];
    const Eigen::Vector3d tilt(uniform(random, -0.4, 0.4), uniform(random, -0.4, 0.4), uniform(random, -0.4, 0.4));
    if (id % 2 == 0) {  // lying on the floor or on machines
      target.p_mm = {uniform(random, -3000, 3000), uniform(random, -3000, 3000), uniform(random, 0, 500)};
      target.normal = (Eigen::Vector3d::UnitZ() + tilt).normalized();
    } else {  // standing along the back
      target.p_mm = {uniform(random, -3000, 3000), uniform(random, 1500, 3000), uniform(random, 200, 2000)};
      target.normal = (-Eigen::Vector3d::UnitY() + tilt).normalized();
    }
  }
  const std::map<int, Eigen::Vector3d> ends{
      {101, {-1000, -1500, 20}}, {102, {1000, -1480, 25}}, {103, {-600, 800, 60}}, {104, {-500, 1795, 70}}};
  for (const auto& [id, p] : ends) field.targets[id] = {p, Eigen::Vector3d::UnitZ()};
  for (int k = 0; k < photos; ++k) {
    const double around = uniform(random, -2.6, -0.5);
    const double distance = uniform(random, 4500, 6500);
    const Eigen::Vector3d from(distance * std::cos(around), distance * std::sin(around), uniform(random, 1200, 3600));
    const Eigen::Vector3d at(uniform(random, -1000, 1000), uniform(random, -300, 1500), uniform(random, 300, 900));
    field.poses.push_back(looking(from, at, held_roll(k, random)));
  }
  return field;
}

PhotographedField flat_field(int count, int photos, std::mt19937& random) {
  PhotographedField field;
  field.camera = reflex_camera();
  for (int id = 1; id <= count; ++id)
    field.targets[id] = {{uniform(random, -2000, 2000), uniform(random, -2, 2), uniform(random, 0, 3000)},
                         -Eigen::Vector3d::UnitY()};
  const std::map<int, Eigen::Vector3d> ends{
      {101, {-1000, 0, 1500}}, {102, {1000, 1, 1500}}, {103, {0, 0, 1000}}, {104, {10, 1, 2000}}};
  for (const auto& [id, p] : ends) field.targets[id] = {p, -Eigen::Vector3d::UnitY()};
  for (int k = 0; k < photos; ++k) {
    const Eigen::Vector3d from(uniform(random, -3500, 3500), uniform(random, -5500, -3500), uniform(random, 300, 3500));
    field.poses.push_back(
        looking(from, {uniform(random, -500, 500), 0.0, uniform(random, 1200, 1800)}, held_roll(k, random)));
  }
  return field;
}

std::vector<SurveyPhoto> photograph(const PhotographedField& field, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, field.noise_px);
  std::normal_distribution<double> of_diameter(0.0, 0.05);
  std::vector<SurveyPhoto> photos;
  for (std::size_t k = 0; k < field.poses.size(); ++k) {
    SurveyPhoto photo{"photo" + std::to_string(k), {}};
    for (const auto& [id, target] : field.targets) {
      const CameraPose& pose = field.poses[k];
      const Eigen::Vector3d p = pose.cam_from_world(target.p_mm);
      const Eigen::Vector3d back = (pose.center_world_mm - target.p_mm).normalized();
      if (p.z() < 500.0 || back.dot(target.normal) < 0.35) continue;  // flatter than 70 deg is not read
      constexpr double kBorder_px = 30.0;
      const ObservedPoint middle = project(field.camera, p);
      if (middle.x_px < kBorder_px || middle.y_px < kBorder_px || middle.x_px > field.camera.width_px - kBorder_px ||
          middle.y_px > field.camera.height_px - kBorder_px)
        continue;
      DetectedTarget seen = image_of(field, target, pose);
      seen.id = id;
      seen.center.x_px += noise(random);
      seen.center.y_px += noise(random);
      seen.sigma_px = field.noise_px;
      seen.dot_diameter_px += of_diameter(random);
      photo.targets.push_back(seen);
    }
    photos.push_back(std::move(photo));
  }
  return photos;
}

std::vector<ScaleBar> bars_of(const PhotographedField& field) {
  const auto bar = [&](int a, int b) {
    return ScaleBar{a, b, (field.targets.at(a).p_mm - field.targets.at(b).p_mm).norm(), 0.01};
  };
  return {bar(101, 102), bar(103, 104)};
}

SurveyInput input_of(const PhotographedField& field, std::mt19937& random) {
  SurveyInput input;
  input.camera.id = "camera";
  input.camera.width_px = field.camera.width_px;
  input.camera.height_px = field.camera.height_px;
  input.camera.pixel_pitch_um = field.camera.pixel_pitch_um;
  input.camera.principal_point = {0.5 * (field.camera.width_px - 1), 0.5 * (field.camera.height_px - 1)};
  input.photos = photograph(field, random);
  input.bars = bars_of(field);
  return input;
}

double rms_after_fit(const PhotographedField& field, const Survey& survey) {
  std::vector<Eigen::Vector3d> measured, truth;
  for (const auto& [id, target] : survey.targets) {
    measured.push_back(target.p_world_mm);
    truth.push_back(field.targets.at(id).p_mm);
  }
  return fit_points(measured, truth, false).rms;
}

}  // namespace imprint
