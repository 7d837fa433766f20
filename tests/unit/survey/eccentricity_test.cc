#include "survey/eccentricity.h"

#include <catch2/catch.hpp>

#include "tests/unit/survey/photographed_field.h"

namespace imprint {

TEST_CASE("eccentricity: the centre of a dot's image lies where its outline says") {
  std::mt19937 random(1);
  auto field = large_field(20, 10, random);
  field.noise_px = 0.0;
  field.dot_radius_mm = 40.0;
  const auto photos = photograph(field, random);
  double largest = 0.0, left = 0.0;
  for (std::size_t k = 0; k < photos.size(); ++k) {
    for (const DetectedTarget& seen : photos[k].targets) {
      const auto& target = field.targets.at(seen.id);
      const ObservedPoint centre = project(field.camera, field.poses[k].cam_from_world(target.p_mm));
      const ObservedPoint shift =
          eccentricity_px(field.camera, field.poses[k], target.p_mm, {field.dot_radius_mm, target.normal, 10});
      const double dx = seen.center.x_px - centre.x_px, dy = seen.center.y_px - centre.y_px;
      largest = std::max(largest, std::hypot(dx, dy));
      left = std::max(left, std::hypot(dx - shift.x_px, dy - shift.y_px));
    }
  }
  CHECK(largest > 0.1);
  CHECK(left < 0.002);  // polygons of 64 and 180 corners
}

TEST_CASE("eccentricity: plates' normals and dots' radii are found from the sizes of the dots") {
  std::mt19937 random(2);
  auto field = large_field(20, 20, random);
  Network network;
  network.camera = field.camera;
  for (const CameraPose& pose : field.poses) network.poses.emplace_back(pose);
  for (const auto& [id, target] : field.targets) network.points[id] = target.p_mm;
  const auto sights = sights_of(photograph(field, random), 0.01);
  const auto discs = find_dot_discs(network, sights);
  CHECK(discs.size() > 15);
  int near = 0;
  for (const auto& [id, disc] : discs) {
    INFO("target " << id << " from " << disc.sights << " sights: radius " << disc.radius);
    CHECK(disc.radius == Approx(field.dot_radius_mm).epsilon(0.03));
    // 5 deg of tilt are a tenth of the eccentricity.
    near += disc.normal.dot(field.targets.at(id).normal) > std::cos(5.0 * 3.14159265 / 180.0) ? 1 : 0;
  }
  CHECK(near >= 0.9 * static_cast<double>(discs.size()));
}

}  // namespace imprint
