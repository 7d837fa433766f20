#include "simulation/silhouette_outline.h"

#include <cmath>
#include <numbers>

#include <catch2/catch.hpp>
#include <opencv2/imgproc.hpp>

#include "simulation/layout.h"
#include "simulation/simulation.h"

namespace imprint {
namespace {

Scene forge_scene() {
  auto scene = read_scene(IMPRINT_SCENES "/forge.toml");
  REQUIRE(scene);
  return *scene;
}

// How far a ray (body frame) stays from the solid, in mm across the sections; negative where it enters.
double clearance(const ForgingBody& body, const Eigen::Vector3d& center, const Eigen::Vector3d& direction,
                 double near_x) {
  double nearest = 1e9;
  // Along the ray the distance from the axis has one minimum; the section there and its neighbours decide.
  const Eigen::Vector2d d = direction.tail<2>();
  for (double dx = -40.0; dx <= 40.0; dx += 0.05) {
    const double x = near_x + dx;
    if (x < 0.0 || x > body.length_mm()) continue;
    const SectionShape section = body.section(x);
    const double k = (x - center.x()) / direction.x();
    const Eigen::Vector2d p = center.tail<2>() + k * d - section.center;
    // Distance from a convex curve outside it: the largest excess over the support.
    double excess = -1e9;
    const double toward = std::atan2(p.y(), p.x());
    for (double phi = toward - 0.2; phi <= toward + 0.2; phi += 0.001) {
      excess = std::max(excess, p.x() * std::cos(phi) + p.y() * std::sin(phi) - section.support(phi).h);
    }
    nearest = std::min(nearest, excess);
  }
  return nearest;
}

}  // namespace

TEST_CASE("outline: the ray of a rim point touches the solid and does not enter it") {
  const Scene scene = forge_scene();
  const auto layout = lay_out(scene);
  REQUIRE(layout);
  const std::size_t c = 0;
  const CameraModel& camera = scene.cameras[c].model;
  const CameraPose& pose = layout->poses[c];
  const BodyPose& body_pose = layout->body_poses[1];
  const auto outline = body_outline(layout->body, body_pose, camera, pose, 0.5);
  REQUIRE(outline);
  const Eigen::Vector3d center = body_pose.body_from_world(pose.center_world_mm);
  for (const auto* rim : {&outline->upper, &outline->lower}) {
    for (const double part : {0.05, 0.0915, 0.2, 0.4, 0.571, 0.7, 0.895, 0.96}) {  // flats, bow and steps
      const auto i = static_cast<std::size_t>(part * static_cast<double>(rim->size() - 1));
      const double x = layout->body.length_mm() * static_cast<double>(i) / static_cast<double>(rim->size() - 1);
      const Eigen::Vector3d ray = body_pose.R_world_body.transpose() * pose.R_cam_world.transpose() *
                                  ray_direction_cam(camera.focal_length_px, undistort(camera, (*rim)[i]));
      // 0.002 px are 0.0026 mm here; the scan's steps leave less.
      CHECK(clearance(layout->body, center, ray, x) == Approx(0.0).margin(0.0026));
    }
  }
}

TEST_CASE("outline: the rims of a bar with faces are the outermost of all its boundary") {
  Scene scene = forge_scene();
  scene.forging.stations = {{0.0, 300.0}};
  scene.forging.circularity_mm = 0.0;
  scene.forging.press_marks = 0;
  for (const int faces : {4, 8}) {
    scene.forging.faces = faces;
    const auto layout = lay_out(scene);
    REQUIRE(layout);
    for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
      for (const BodyPose& body_pose : layout->body_poses) {
        const Eigen::Vector3d center = body_pose.body_from_world(layout->poses[c].center_world_mm);
        for (const double x : {0.0, 430.0, 1300.0}) {
          const SectionShape section = layout->body.section(x);
          const auto phi = contour_directions(section, x, center);
          // Without steps a rim is where the angle about the camera, in the section's own plane, is extreme.
          const Eigen::Vector2d eye = center.tail<2>() + (x - center.x()) * section.center_dx;
          const Eigen::Vector2d middle = section.center - eye;
          const auto seen_at = [&](double direction) {
            const Eigen::Vector2d p = section.boundary(direction) - eye;
            return std::atan2(middle.x() * p.y() - middle.y() * p.x(), middle.dot(p));
          };
          double least = 1e9, most = -1e9;
          for (double direction = 0.0; direction < 2.0 * std::numbers::pi; direction += 1e-3)
            least = std::min(least, seen_at(direction)), most = std::max(most, seen_at(direction));
          // A thousandth of a turn along an arc of 25 mm leaves 1e-5 mm of 7 m.
          CHECK(std::min(seen_at(phi[0]), seen_at(phi[1])) == Approx(least).margin(1e-8));
          CHECK(std::max(seen_at(phi[0]), seen_at(phi[1])) == Approx(most).margin(1e-8));
        }
      }
    }
  }
}

TEST_CASE("outline: no point of the solid is seen outside it, and every end's rim reaches it") {
  const Scene scene = forge_scene();
  const auto layout = lay_out(scene);
  REQUIRE(layout);
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const CameraModel& camera = scene.cameras[c].model;
    const CameraPose& pose = layout->poses[c];
    const BodyPose& body_pose = layout->body_poses[0];
    const auto outline = body_outline(layout->body, body_pose, camera, pose, 0.25);
    REQUIRE(outline);
    const ObservedPoint origin = outline->upper.front();  // floats near zero keep 1e-4 px
    std::vector<cv::Point2f> polygon;
    for (const ObservedPoint& p : outline->polygon()) {
      polygon.emplace_back(static_cast<float>(p.x_px - origin.x_px), static_cast<float>(p.y_px - origin.y_px));
    }
    const auto inside_by = [&](double x, double phi) {
      const Eigen::Vector2d b = layout->body.section(x).boundary(phi);
      const ObservedPoint seen = project(camera, pose.cam_from_world(body_pose.world_from_body({x, b.x(), b.y()})));
      return cv::pointPolygonTest(
          polygon, {static_cast<float>(seen.x_px - origin.x_px), static_cast<float>(seen.y_px - origin.y_px)}, true);
    };
    const double length = layout->body.length_mm();
    for (const double x : {0.0, 0.4, 3.0, 170.0, 428.0, 950.0, 1070.0, 1420.0, 1893.0, length}) {
      double outermost = 1e9;
      for (double phi = 0.0; phi < 6.283; phi += 0.01) outermost = std::min(outermost, inside_by(x, phi));
      CHECK(outermost > -0.002);
      CHECK(outermost < 0.05);  // phi in steps of 0.01: a sagitta of 0.004 px and more at the tips
    }
  }
}

TEST_CASE("outline: a cylinder from afar has the rims of its tangent planes") {
  // One mm radius in a thousand: analytic tangents of a circle seen from a point.
  ForgingScene cylinder;
  cylinder.length_mm = 1000.0;
  cylinder.stations = {{0.0, 200.0}};
  cylinder.eccentricity_mm = cylinder.bow_mm = cylinder.circularity_mm = 0.0;
  cylinder.press_marks = 0;
  const auto body = ForgingBody::make(cylinder, 80.0, 1);
  REQUIRE(body);
  CameraModel camera;
  camera.id = "plain";
  camera.width_px = 2000;
  camera.height_px = 1000;
  camera.focal_length_px = 4000.0;
  camera.principal_point = {1000.0, 500.0};
  CameraPose pose;  // looks along +y from y = -5000 at the middle, z up
  pose.center_world_mm = {500.0, -5000.0, 0.0};
  pose.R_cam_world << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const auto outline = body_outline(*body, {}, camera, pose, 1.0);
  REQUIRE(outline);
  const double rim = 4000.0 * std::tan(std::asin(100.0 / 5000.0));
  for (const ObservedPoint& p : outline->upper) CHECK(p.y_px == Approx(500.0 - rim).margin(1e-9));
  for (const ObservedPoint& p : outline->lower) CHECK(p.y_px == Approx(500.0 + rim).margin(1e-9));
  // The end's near half bulges: its nearest point is 100 mm closer to the camera.
  double leftmost = 1e9;
  for (const ObservedPoint& p : outline->first_end) leftmost = std::min(leftmost, p.x_px);
  CHECK(leftmost == Approx(1000.0 - 4000.0 * 500.0 / 4900.0).margin(1e-4));
}

TEST_CASE("outline: a camera that looks along the forging is an error that names it") {
  Scene scene = forge_scene();
  scene.cameras[0].offset_x_mm = 60000.0;
  scene.cameras[0].distance_mm = 200.0;
  const auto body = ForgingBody::make(scene.forging, scene.spec.end_section_mm, 1);
  REQUIRE(body);
  const auto outline = body_outline(*body, {}, scene.cameras[0].model, camera_pose(scene.cameras[0]), 0.5);
  REQUIRE_FALSE(outline);
  CHECK_THAT(outline.error().message, Catch::Contains("cam1"));
}

}  // namespace imprint
