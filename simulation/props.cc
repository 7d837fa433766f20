#include "simulation/props.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "simulation/coverage.h"
#include "simulation/random.h"
#include "simulation/texture.h"
#include "simulation/truth.h"

namespace imprint {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double rad_per_deg = pi / 180.0;
constexpr int tile_px = 256;

// One camera's view of one observation, in the frame of the forging: x along its axis from the first end, z up.
class PropView {
 public:
  PropView(const Scene& scene, const Layout& layout, int observation, int camera)
      : model_(scene.cameras[static_cast<std::size_t>(camera)].model),
        pose_(layout.poses[static_cast<std::size_t>(camera)]),
        frame_(forging_frame(layout.body_poses[static_cast<std::size_t>(observation)])),
        camera_in_frame_(frame_.R_forging_world * (pose_.center_world_mm - frame_.origin_world_mm)) {}

  [[nodiscard]] const Eigen::Vector3d& camera() const { return camera_in_frame_; }
  [[nodiscard]] const CameraPose& pose() const { return pose_; }
  [[nodiscard]] Eigen::Vector3d world(const Eigen::Vector3d& p) const {
    return frame_.R_forging_world.transpose() * p + frame_.origin_world_mm;
  }

  // The image of the convex hull of points of the world; nothing when a part of it lies beside or behind the camera.
  [[nodiscard]] std::optional<Prop> show(const std::vector<Eigen::Vector3d>& points_world) const {
    std::vector<cv::Point2f> image, hull;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : points_world) {
      const Eigen::Vector3d p_cam = pose_.cam_from_world(p);
      if (p_cam.z() < 0.25 * p_cam.norm()) return std::nullopt;
      const ObservedPoint seen = project(model_, p_cam);
      image.emplace_back(static_cast<float>(seen.x_px), static_cast<float>(seen.y_px));
      middle += p / static_cast<double>(points_world.size());
    }
    cv::convexHull(image, hull);
    Prop prop;
    for (const cv::Point2f& p : hull) prop.outline.push_back({p.x, p.y});
    prop.distance_mm = (middle - pose_.center_world_mm).norm();
    return prop;
  }

  [[nodiscard]] ObservedPoint at(const Eigen::Vector3d& p_world) const {
    return project(model_, pose_.cam_from_world(p_world));
  }

 private:
  const CameraModel& model_;
  const CameraPose& pose_;
  ForgingFrame frame_;
  Eigen::Vector3d camera_in_frame_;
};

// The radius of the smallest cylinder about the ideal axis that holds the body between two stations.
double reach_mm(const ForgingBody& body, double from_mm, double to_mm) {
  double reach = 0.0;
  for (int i = 0; i <= 40; ++i) {
    const SectionShape section = body.section(std::clamp(from_mm + (to_mm - from_mm) * i / 40, 0.0, body.length_mm()));
    for (int k = 0; k < 36; ++k) {
      const double phi = 2.0 * pi * k / 36;
      reach =
          std::max(reach, section.center.dot(Eigen::Vector2d(std::cos(phi), std::sin(phi))) + section.support(phi).h);
    }
  }
  return reach;
}

// One flank of a V that touches the cylinder from below (up = -1) or above (up = 1), on one side of it. Cylinder and
// flank lie on two sides of the plane in which they touch, so the camera sees that first which is on its own.
void add_flank(const PropView& view, double from_mm, double to_mm, double reach, double up, double side, double outer,
               double depth, const Prop& look, std::vector<Prop>& props) {
  const double root = std::numbers::sqrt2;
  std::vector<Eigen::Vector3d> corners;
  for (const double x : {from_mm, to_mm}) {
    for (const auto& [y, z] : {std::pair{0.0, root}, {outer, root - outer}, {outer, depth}, {0.0, depth}})
      corners.push_back(view.world({x, side * y * reach, up * z * reach}));
  }
  auto prop = view.show(corners);
  if (!prop) return;
  const Eigen::Vector2d normal = Eigen::Vector2d(side, up) / root;
  prop->before_forging = normal.dot(view.camera().tail<2>()) > reach;
  prop->level = look.level * (side > 0.0 ? 1.0 : 0.8), prop->grain = look.grain, prop->seed = look.seed;
  props.push_back(*prop);
}

// A box along the axis between two stations off an end, `half` wide and high to each side. It is seen before the
// forging only by a camera on its own side of that end's plane.
void add_box(const PropView& view, double near_mm, double far_mm, double half, double end_mm, const Prop& look,
             std::vector<Prop>& props) {
  std::vector<Eigen::Vector3d> corners;
  for (const double x : {near_mm, far_mm})
    for (const double y : {-half, half})
      for (const double z : {-half, half}) corners.push_back(view.world({x, y, z}));
  auto prop = view.show(corners);
  if (!prop) return;
  prop->before_forging = (view.camera().x() - end_mm) * (far_mm - end_mm) > 0.0;
  prop->level = look.level, prop->grain = look.grain, prop->seed = look.seed;
  props.push_back(*prop);
}

void add_jaw(const Scene& scene, const Layout& layout, const PropView& view, std::vector<Prop>& props) {
  if (scene.jaw.holds == JawScene::End::none) return;
  const double length = layout.body.length_mm(), cover = scene.jaw.cover_mm;
  const bool first = scene.jaw.holds == JawScene::End::first;
  const auto at = [&](double from_end_mm) { return first ? from_end_mm : length - from_end_mm; };
  const double reach = reach_mm(layout.body, at(0.0), at(cover));
  Prop look;
  look.level = scene.jaw.level, look.grain = 0.25, look.seed = stream_seed(scene.seed, "jaw");
  for (const double up : {1.0, -1.0})
    for (const double side : {1.0, -1.0})
      add_flank(view, at(-0.6 * reach), at(cover), reach, up, side, std::numbers::sqrt2, 2.0, look, props);
  look.level *= 0.8;
  add_box(view, at(-0.6 * reach), at(-1.6 * reach), 1.7 * reach, at(0.0), look, props);
  look.level *= 0.9;
  add_box(view, at(-1.6 * reach), at(-1.2 * length), 0.8 * reach, at(0.0), look, props);
}

void add_blocks(const Scene& scene, const Layout& layout, const PropView& view, std::vector<Prop>& props) {
  for (std::size_t i = 0; i < scene.v_blocks.at_mm.size(); ++i) {
    const double from = scene.v_blocks.at_mm[i] - 0.5 * scene.v_blocks.width_mm, to = from + scene.v_blocks.width_mm;
    Prop look;
    look.level = scene.v_blocks.level, look.grain = 0.1, look.seed = stream_seed(scene.seed, "blocks", i);
    for (const double side : {1.0, -1.0})
      add_flank(view, from, to, reach_mm(layout.body, from, to), -1.0, side, 1.2, 3.0, look, props);
  }
}

void add_others(const Scene& scene, const Layout& layout, const PropView& view, int observation,
                std::vector<Prop>& props) {
  const BodyPose& forging = layout.body_poses[static_cast<std::size_t>(observation)];
  const double forging_mm =
      (forging.world_from_body({0.5 * layout.body.length_mm(), 0.0, 0.0}) - view.pose().center_world_mm).norm();
  for (std::size_t i = 0; i < scene.others.size(); ++i) {
    const OtherBody& other = scene.others[i];
    const Eigen::Vector3d axis =
        Eigen::AngleAxisd(other.yaw_deg * rad_per_deg, Eigen::Vector3d::UnitZ()) *
        (Eigen::AngleAxisd(other.pitch_deg * rad_per_deg, Eigen::Vector3d::UnitY()) * scene.spec.axis_direction_world);
    const Eigen::Vector3d half = 0.5 * other.length_mm * axis;
    const Eigen::Vector3d across = axis.unitOrthogonal(), third = axis.cross(across);
    std::vector<Eigen::Vector3d> points;
    for (const double sign : {-1.0, 1.0}) {
      if (other.flat) {
        for (const double z : {-0.5, 0.5})
          points.emplace_back(other.center_world_mm + sign * half + Eigen::Vector3d(0.0, 0.0, z * other.diameter_mm));
        continue;
      }
      for (int k = 0; k < 64; ++k) {
        const double a = 2.0 * pi * k / 64;
        points.emplace_back(other.center_world_mm + sign * half +
                            0.5 * other.diameter_mm * (std::cos(a) * across + std::sin(a) * third));
      }
    }
    auto prop = view.show(points);
    if (!prop) continue;
    prop->before_forging = prop->distance_mm < forging_mm;
    prop->level = other.level, prop->grain = 0.12, prop->seed = stream_seed(scene.seed, "other", i);
    if (!other.flat && scene.kind == SceneKind::forge) {
      prop->limb = scene.surface.limb_darkening;
      prop->axis_from = view.at(other.center_world_mm - half), prop->axis_to = view.at(other.center_world_mm + half);
    }
    props.push_back(*prop);
  }
}

// Half the width of an outline across a line.
double half_width(const Prop& prop, double nx, double ny) {
  double low = 1e30, high = -1e30;
  for (const ObservedPoint& p : prop.outline) {
    const double d = (p.x_px - prop.axis_from.x_px) * nx + (p.y_px - prop.axis_from.y_px) * ny;
    low = std::min(low, d), high = std::max(high, d);
  }
  return std::max(1.0, 0.5 * (high - low));
}

void paint_prop(const Prop& prop, cv::Mat& image) {
  const Coverage coverage = polygon_coverage(prop.outline, image.size());
  if (coverage.region.empty()) return;
  const cv::Mat tile = noise_tile(prop.seed, tile_px, 0.7);
  const double dx = prop.axis_to.x_px - prop.axis_from.x_px, dy = prop.axis_to.y_px - prop.axis_from.y_px;
  const double length = std::max(1e-6, std::hypot(dx, dy)), nx = -dy / length, ny = dx / length;
  const double half = half_width(prop, nx, ny);
  for (int j = 0; j < coverage.region.height; ++j) {
    const int y = coverage.region.y + j;
    const auto* share = coverage.share.ptr<double>(j);
    const float* texture = tile.ptr<float>(y % tile_px);
    float* row = image.ptr<float>(y) + coverage.region.x;
    for (int i = 0; i < coverage.region.width; ++i) {
      if (share[i] <= 0.0) continue;
      const int x = coverage.region.x + i;
      double level = prop.level * (1.0 + prop.grain * static_cast<double>(texture[x % tile_px]));
      if (prop.limb > 0.0) {
        const double off = ((x - prop.axis_from.x_px) * nx + (y - prop.axis_from.y_px) * ny) / half;
        level *= 1.0 - prop.limb * (1.0 - std::sqrt(std::max(0.0, 1.0 - off * off)));
      }
      row[i] += static_cast<float>(share[i] * (level - static_cast<double>(row[i])));
    }
  }
}

}  // namespace

std::vector<Prop> props_of(const Scene& scene, const Layout& layout, int observation, int camera) {
  const PropView view(scene, layout, observation, camera);
  std::vector<Prop> props;
  add_jaw(scene, layout, view, props);
  add_blocks(scene, layout, view, props);
  add_others(scene, layout, view, observation, props);
  std::stable_sort(props.begin(), props.end(),
                   [](const Prop& a, const Prop& b) { return a.distance_mm > b.distance_mm; });
  return props;
}

void paint_props(const std::vector<Prop>& props, bool before_forging, cv::Mat& image) {
  for (const Prop& prop : props)
    if (prop.before_forging == before_forging) paint_prop(prop, image);
}

std::vector<std::pair<double, double>> hidden_ranges_mm(const std::vector<Prop>& props,
                                                        const std::vector<ObservedPoint>& rim, double length_mm) {
  std::vector<std::vector<cv::Point2f>> outlines;
  for (const Prop& prop : props) {
    if (!prop.before_forging) continue;
    auto& outline = outlines.emplace_back();
    for (const ObservedPoint& p : prop.outline)
      outline.emplace_back(static_cast<float>(p.x_px), static_cast<float>(p.y_px));
  }
  std::vector<std::pair<double, double>> ranges;
  bool before = false;
  const double step_mm = length_mm / static_cast<double>(rim.size() - 1);
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const cv::Point2f p(static_cast<float>(rim[i].x_px), static_cast<float>(rim[i].y_px));
    const bool hidden = std::any_of(outlines.begin(), outlines.end(),
                                    [&](const auto& outline) { return cv::pointPolygonTest(outline, p, false) >= 0; });
    const double at_mm = static_cast<double>(i) * step_mm;
    if (hidden && !before) ranges.emplace_back(at_mm, at_mm);
    if (hidden) ranges.back().second = at_mm;
    before = hidden;
  }
  return ranges;
}

}  // namespace imprint
