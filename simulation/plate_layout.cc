#include "simulation/plate_layout.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Geometry>

#include "simulation/random.h"

namespace imprint {
namespace {

constexpr int tries_per_plate = 60;
constexpr int fewest_per_camera = 8;

struct Disc {
  double x_px, y_px, radius_px;
};

// The image of the ball around the plate, or nothing where the camera does not see its front.
std::optional<Disc> seen_disc(const Plate& plate, double plate_mm, const CameraModel& camera, const CameraPose& pose) {
  const Eigen::Vector3d p = pose.cam_from_world(plate.center_world_mm);
  if (p.z() <= 0.2 * plate_mm || plate_facing(plate, pose) <= 0.0) return std::nullopt;
  const ObservedPoint center = project(camera, p);
  return Disc{center.x_px, center.y_px, 0.75 * plate_mm * camera.focal_length_px / p.z()};
}

double distance_to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - (a + t * (b - a))).norm();
}

class PlateRoom {
 public:
  PlateRoom(const Scene& scene, const Layout& layout) : scene_(scene), layout_(layout) {}

  // No plate before or behind another one or the forging, in any camera.
  bool free(const Plate& plate, const std::vector<Plate>& others) const {
    for (std::size_t c = 0; c < scene_.cameras.size(); ++c) {
      const CameraModel& camera = scene_.cameras[c].model;
      const auto disc = seen_disc(plate, scene_.targets.plate_mm, camera, layout_.poses[c]);
      if (!disc) continue;
      if (meets_forging(*disc, camera, layout_.poses[c])) return false;
      for (const Plate& other : others) {
        const auto taken = seen_disc(other, scene_.targets.plate_mm, camera, layout_.poses[c]);
        if (taken &&
            std::hypot(taken->x_px - disc->x_px, taken->y_px - disc->y_px) < taken->radius_px + disc->radius_px) {
          return false;
        }
      }
    }
    return true;
  }

 private:
  bool meets_forging(const Disc& disc, const CameraModel& camera, const CameraPose& pose) const {
    const BodyPose& body = layout_.body_poses.front();
    const Eigen::Vector3d start = pose.cam_from_world(body.world_from_body(Eigen::Vector3d::Zero()));
    const Eigen::Vector3d end = pose.cam_from_world(body.world_from_body({layout_.body.length_mm(), 0.0, 0.0}));
    const ObservedPoint a = project(camera, start), b = project(camera, end);
    const double clearance =
        1.35 * layout_.body.largest_radius_mm() * camera.focal_length_px / std::min(start.z(), end.z());
    return distance_to_segment({disc.x_px, disc.y_px}, {a.x_px, a.y_px}, {b.x_px, b.y_px}) < disc.radius_px + clearance;
  }

  const Scene& scene_;
  const Layout& layout_;
};

// A plate somewhere behind the given image point that looks back at the camera, or nothing if that is under the floor.
std::optional<Plate> random_plate(const Scene& scene, std::size_t camera_index, const CameraPose& pose,
                                  const ObservedPoint& at, Random& random) {
  const SceneCamera& camera = scene.cameras[camera_index];
  const TargetScene& targets = scene.targets;
  const Eigen::Vector3d ray =
      pose.R_cam_world.transpose() * ray_direction_cam(camera.model.focal_length_px, undistort(camera.model, at));
  double depth = camera.distance_mm * (1.0 + random.uniform(-targets.depth_spread, targets.depth_spread));
  const double floor_mm = 0.6 * targets.plate_mm;
  if (pose.center_world_mm.z() + depth * ray.z() < floor_mm) depth = (floor_mm - pose.center_world_mm.z()) / ray.z();
  if (depth < 0.5 * camera.distance_mm) return std::nullopt;
  Plate plate;
  plate.center_world_mm = pose.center_world_mm + depth * ray;
  const double azimuth = random.angle_rad(),
               tilt = random.uniform(0.0, targets.max_tilt_deg) * std::numbers::pi / 180.0;
  // Upright within some degrees, as people mount them, then turned about an axis in its plane.
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0.0)) *
                                Eigen::AngleAxisd(random.uniform(-0.5, 0.5), Eigen::Vector3d::UnitZ()))
                                   .toRotationMatrix();
  const Eigen::Matrix3d facing =
      Eigen::Quaterniond::FromTwoVectors(pose.R_cam_world.row(2).transpose(), ray).toRotationMatrix();
  plate.R_world_plate = facing * pose.R_cam_world.transpose() * turn;
  return plate;
}

void soil(Plate& plate, const Scene& scene, Random& random) {
  const double chance = random.uniform();
  const double hidden = std::min(0.5, scene.corruption * scene.targets.hidden_fraction);
  const double dirty = std::min(0.5, scene.corruption * scene.targets.dirty_fraction);
  const double angle = random.angle_rad(), cover = random.uniform(0.0, 2.4);
  plate.brightness = random.uniform(0.75, 1.25);
  if (chance < hidden) {
    plate.state = PlateState::hidden;
    plate.cover_direction = {std::cos(angle), std::sin(angle)};
    plate.cover_mm = cover * 0.5 * scene.targets.dot_diameter_mm;
  } else if (chance < hidden + dirty) {
    plate.state = PlateState::dirty;
  }
}

std::vector<TargetCode> shuffled_codes(const TargetLibrary& library, Random& random) {
  std::vector<TargetCode> codes = library.codes;
  for (int i = static_cast<int>(codes.size()) - 1; i > 0; --i) {
    std::swap(codes[static_cast<std::size_t>(i)], codes[static_cast<std::size_t>(random.index(i + 1))]);
  }
  return codes;
}

}  // namespace

bool plate_readable(const Plate& plate, double plate_mm, const CameraModel& camera, const CameraPose& pose) {
  if (plate_facing(plate, pose) < readable_facing) return false;
  const auto disc = seen_disc(plate, plate_mm, camera, pose);
  return disc && disc->x_px > disc->radius_px && disc->x_px < camera.width_px - disc->radius_px &&
         disc->y_px > disc->radius_px && disc->y_px < camera.height_px - disc->radius_px;
}

Result<std::vector<Plate>> place_plates(const Scene& scene, const Layout& layout) {
  Random random(stream_seed(scene.seed, "plates"));
  std::vector<TargetCode> codes = shuffled_codes(layout.library, random);
  const PlateRoom room(scene, layout);
  std::vector<Plate> plates;
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const CameraModel& camera = scene.cameras[c].model;
    const auto seen = [&] {
      return static_cast<int>(std::count_if(plates.begin(), plates.end(), [&](const Plate& plate) {
        return plate_readable(plate, scene.targets.plate_mm, camera, layout.poses[c]);
      }));
    };
    // One plate a cell of the image first, so that they spread; then wherever there is room.
    const int columns = std::max(1, static_cast<int>(std::lround(std::sqrt(scene.targets.per_camera * 4.0 / 3.0))));
    const int rows = (scene.targets.per_camera + columns - 1) / columns;
    int missing = scene.targets.per_camera - seen();
    const int cells = columns * rows;
    const int first = random.index(cells);
    for (int attempt = 0; missing > 0 && attempt < tries_per_plate * cells && !codes.empty(); ++attempt) {
      const int cell = (first + attempt * 7) % cells;
      const bool anywhere = attempt >= 10 * cells;
      const double cx = anywhere ? random.uniform() : (cell % columns + random.uniform()) / columns;
      const double cy = anywhere ? random.uniform() : (cell / columns + random.uniform()) / rows;
      const ObservedPoint at{cx * (camera.width_px - 1), cy * (camera.height_px - 1)};
      auto plate = random_plate(scene, c, layout.poses[c], at, random);
      if (!plate || !plate_readable(*plate, scene.targets.plate_mm, camera, layout.poses[c]) ||
          !room.free(*plate, plates)) {
        continue;
      }
      plate->code = codes.back();
      codes.pop_back();
      soil(*plate, scene, random);
      plates.push_back(*plate);
      --missing;
    }
    if (const int found = seen(); found < std::min(fewest_per_camera, scene.targets.per_camera)) {
      return invalid_input(
          "targets: camera \"{}\" sees {} plates, expected at least {}; use a larger library ({} codes), "
          "smaller plates or fewer per camera",
          camera.id, found, std::min(fewest_per_camera, scene.targets.per_camera), layout.library.codes.size());
    }
  }
  return plates;
}

}  // namespace imprint
