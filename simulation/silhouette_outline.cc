#include "simulation/silhouette_outline.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace imprint {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int end_points = 1500;

// The camera with the body's frame for its world.
struct BodyView {
  const CameraModel& camera;
  CameraPose pose;

  ObservedPoint show(const Eigen::Vector3d& p_body_mm) const { return project(camera, pose.cam_from_world(p_body_mm)); }
};

Eigen::Vector3d surface_point(const SectionShape& section, double x, double phi) {
  const Eigen::Vector2d p = section.boundary(phi);
  return {x, p.x(), p.y()};
}

// The part of an end's rim that bounds the solid's image. Where the end face is turned away, that is the near half
// (the lateral surface in front of the rim is seen); where the face is seen, the far half.
std::vector<ObservedPoint> end_arc(const BodyView& view, const SectionShape& section, double x, bool face_seen,
                                   double from_phi, double to_phi) {
  const Eigen::Vector2d to_camera = view.pose.center_world_mm.tail<2>() - section.center;
  double toward = std::atan2(to_camera.y(), to_camera.x());
  if (face_seen) toward += pi;
  // Angles relative to the direction that the arc passes through, in (-pi, pi).
  const double from = std::remainder(from_phi - toward, 2.0 * pi), to = std::remainder(to_phi - toward, 2.0 * pi);
  std::vector<ObservedPoint> arc;
  for (int i = 0; i <= end_points; ++i) {
    const double phi = toward + from + (to - from) * i / end_points;
    arc.push_back(view.show(surface_point(section, x, phi)));
  }
  return arc;
}

// First station at which a rim runs back, or -1: there a part of it hides behind a step.
int folded_station(const std::vector<ObservedPoint>& rim, double dx, double dy) {
  for (std::size_t i = 1; i < rim.size(); ++i) {
    if ((rim[i].x_px - rim[i - 1].x_px) * dx + (rim[i].y_px - rim[i - 1].y_px) * dy <= 0.0) return static_cast<int>(i);
  }
  return -1;
}

}  // namespace

std::vector<ObservedPoint> BodyOutline::polygon() const {
  std::vector<ObservedPoint> all(upper);
  all.insert(all.end(), second_end.begin(), second_end.end());
  all.insert(all.end(), lower.rbegin(), lower.rend());
  all.insert(all.end(), first_end.begin(), first_end.end());
  return all;
}

std::array<double, 2> contour_directions(const SectionShape& section, double x_mm,
                                         const Eigen::Vector3d& center_body_mm) {
  const double along = x_mm - center_body_mm.x();
  const Eigen::Vector2d q = section.center - center_body_mm.tail<2>() - along * section.center_dx;
  const double away = std::atan2(q.y(), q.x()), distance = q.norm();
  std::array<double, 2> result{};
  for (int side = 0; side < 2; ++side) {
    const double lift = std::acos(std::clamp(-(section.radius - along * section.radius_dx) / distance, -1.0, 1.0));
    double phi = away + (side == 0 ? -lift : lift);
    // F is positive away from the camera and negative towards it, with one root between on either side.
    double positive = away, negative = away + (side == 0 ? -pi : pi);
    for (int iteration = 0; iteration < 80; ++iteration) {
      const SectionShape::Support s = section.support(phi);
      const double f = q.x() * std::cos(phi) + q.y() * std::sin(phi) + s.h - along * s.h_x;
      const double slope = -q.x() * std::sin(phi) + q.y() * std::cos(phi) + s.h_phi - along * s.h_xphi;
      (f > 0.0 ? positive : negative) = phi;
      const double step = f / slope;
      phi -= step;
      if (std::abs(step) < 1e-13) break;
      // Where a face turns past the camera F's slope changes at once, and Newton's step can leave the bracket.
      const auto [least, most] = std::minmax(positive, negative);
      if (!(phi > least && phi < most)) phi = 0.5 * (least + most);
    }
    result[side] = phi;
  }
  return result;
}

Result<BodyOutline> body_outline(const ForgingBody& body, const BodyPose& body_pose, const CameraModel& camera,
                                 const CameraPose& pose, double spacing_px) {
  BodyView view{camera, {}};
  view.pose.R_cam_world = pose.R_cam_world * body_pose.R_world_body;
  view.pose.center_world_mm = body_pose.body_from_world(pose.center_world_mm);
  const Eigen::Vector3d& center = view.pose.center_world_mm;
  const double length = body.length_mm();
  const auto show_axis = [&](double x) { return view.show({x, 0.0, 0.0}); };
  const ObservedPoint start = show_axis(0.0), end = show_axis(length);
  const double dx = end.x_px - start.x_px, dy = end.y_px - start.y_px, length_px = std::hypot(dx, dy);
  const double reach = 2.0 * body.largest_radius_mm();
  const double nearest =
      std::min(view.pose.cam_from_world({0.0, 0.0, 0.0}).z(), view.pose.cam_from_world({length, 0.0, 0.0}).z());
  if (!(nearest > reach) || !(center.tail<2>().norm() > reach) || !(length_px > 20.0)) {
    return job_failed("camera \"{}\": looks along the forging, stands in it or turns its back; place it to the side",
                      camera.id);
  }

  BodyOutline outline;
  const int stations = static_cast<int>(std::ceil(length_px / spacing_px));
  std::array<double, 2> first{}, second{};
  std::array<std::vector<ObservedPoint>, 2> rims;
  for (int i = 0; i <= stations; ++i) {
    const double x = length * i / stations;
    const SectionShape section = body.section(x);
    const auto phi = contour_directions(section, x, center);
    if (i == 0) first = phi;
    if (i == stations) second = phi;
    for (int side = 0; side < 2; ++side) rims[side].push_back(view.show(surface_point(section, x, phi[side])));
  }
  for (const auto& rim : rims) {
    if (const int fold = folded_station(rim, dx, dy); fold >= 0) {
      return job_failed(
          "camera \"{}\": the rim at {:.0f} mm of the forging hides behind a step; lengthen transition_mm or move the "
          "camera to face the forging",
          camera.id, length * fold / stations);
    }
  }
  const std::size_t middle = rims[0].size() / 2;
  const bool first_is_upper = rims[0][middle].y_px < rims[1][middle].y_px;
  const int up = first_is_upper ? 0 : 1;
  const bool first_face_seen = center.x()<0.0, second_face_seen = center.x()> length;
  outline.first_end = end_arc(view, body.section(0.0), 0.0, first_face_seen, first[1 - up], first[up]);
  outline.second_end = end_arc(view, body.section(length), length, second_face_seen, second[up], second[1 - up]);
  outline.upper = std::move(rims[up]);
  outline.lower = std::move(rims[1 - up]);
  return outline;
}

}  // namespace imprint
