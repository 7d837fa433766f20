#include "simulation/field_photos.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/core.h>
#include <Eigen/Geometry>

#include "simulation/backdrop.h"
#include "simulation/code_set.h"
#include "simulation/frame_renderer.h"
#include "simulation/random.h"

namespace imprint {
namespace {

constexpr double rad_per_deg = std::numbers::pi / 180.0;
constexpr double clearance_plates = 3.0;  // between the middles of two plates, in their sides
constexpr int tries = 2000;

// x right and y down as seen from the front, z away from the viewer.
Eigen::Matrix3d facing(const Eigen::Vector3d& normal, double turn_rad) {
  const Eigen::Vector3d z = -normal.normalized();
  const Eigen::Vector3d level = Eigen::Vector3d::UnitZ().cross(z);
  const Eigen::Vector3d x = level.norm() > 1e-3 ? Eigen::Vector3d(level.normalized()) : z.unitOrthogonal();
  Eigen::Matrix3d R;
  R << x, z.cross(x), z;
  return R * Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

// Towards the half circle of the photographer, who stands at y < 0, and upwards; each a little its own way.
Eigen::Vector3d plate_normal(const Eigen::Vector3d& at, const FieldPhotosScene& scene, Random& random) {
  const Eigen::Vector3d eye(0.3 * at.x(), -0.9 * scene.distance_mm, random.uniform(1500.0, 5000.0));
  const Eigen::Vector3d own(random.uniform(-0.45, 0.45), random.uniform(-0.45, 0.45), random.uniform(-0.3, 0.45));
  return ((eye - at).normalized() + own).normalized();
}

class FieldBuilder {
 public:
  FieldBuilder(const FieldPhotosScene& scene, TargetLibrary library)
      : scene_(scene), codes_(library.codes), random_(stream_seed(scene.seed, "field")), library_(std::move(library)) {
    for (int i = static_cast<int>(codes_.size()) - 1; i > 0; --i)
      std::swap(codes_[static_cast<std::size_t>(i)], codes_[static_cast<std::size_t>(random_.index(i + 1))]);
  }

  Result<std::vector<Plate>> plates(std::vector<FieldBar>& bars) {
    if (static_cast<int>(codes_.size()) < scene_.targets + 4)
      return invalid_input("field photographs: {} targets and 2 bars need {} codes, the library has {}", scene_.targets,
                           scene_.targets + 4, codes_.size());
    add_bar({-1000.0, -1100.0, 60.0}, {990.0, -1060.0, 70.0}, bars);
    add_bar({420.0, 350.0, 90.0}, {560.0, 1340.0, 80.0}, bars);
    for (int i = 0; i < scene_.targets; ++i) {
      int attempt = 0;
      for (; attempt < tries; ++attempt) {
        const Eigen::Vector3d half = 0.5 * scene_.size_mm;
        const Eigen::Vector3d at(random_.uniform(-half.x(), half.x()), random_.uniform(-half.y(), half.y()),
                                 random_.uniform(0.5 * scene_.target.plate_mm, scene_.size_mm.z()));
        if (!free(at)) continue;
        add(at, plate_normal(at, scene_, random_));
        break;
      }
      if (attempt == tries)
        return invalid_input("field photographs: no room for {} plates of {} mm; ask for fewer", scene_.targets,
                             scene_.target.plate_mm);
    }
    return std::move(plates_);
  }

  // From the half circle y < 0, at three heights.
  std::vector<CameraPose> walk() {
    std::vector<CameraPose> poses;
    for (int k = 0; k < scene_.photos; ++k) {
      const double around = (-90.0 + random_.uniform(-80.0, 80.0)) * rad_per_deg;
      const double distance = scene_.distance_mm * random_.uniform(0.8, 1.15);
      const double height = (k % 3 == 0 ? 900.0 : k % 3 == 1 ? 1800.0 : 3300.0) + random_.uniform(-250.0, 250.0);
      const Eigen::Vector3d from(distance * std::cos(around), distance * std::sin(around), height);
      const Eigen::Vector3d at(random_.uniform(-0.2, 0.2) * scene_.size_mm.x(),
                               random_.uniform(-0.15, 0.25) * scene_.size_mm.y(),
                               random_.uniform(0.2, 0.55) * scene_.size_mm.z());
      const double roll = (k % 4 == 1 ? 90.0 : k % 4 == 3 ? -90.0 : 0.0) + random_.uniform(-6.0, 6.0);
      poses.push_back(held(from, at, roll * rad_per_deg));
    }
    return poses;
  }

  TargetLibrary library() && { return std::move(library_); }

 private:
  static CameraPose held(const Eigen::Vector3d& from, const Eigen::Vector3d& at, double roll_rad) {
    const Eigen::Vector3d forward = (at - from).normalized();
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    Eigen::Matrix3d level;
    level << right.transpose(), forward.cross(right).transpose(), forward.transpose();
    CameraPose pose;
    pose.center_world_mm = from;
    pose.R_cam_world = Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() * level;
    return pose;
  }

  [[nodiscard]] bool free(const Eigen::Vector3d& at) const {
    return std::all_of(plates_.begin(), plates_.end(), [&](const Plate& other) {
      return (other.center_world_mm - at).norm() > clearance_plates * scene_.target.plate_mm;
    });
  }

  int add(const Eigen::Vector3d& at, const Eigen::Vector3d& normal) {
    Plate plate;
    plate.code = codes_.back();
    codes_.pop_back();
    plate.center_world_mm = at;
    plate.R_world_plate = facing(normal, random_.uniform(-0.6, 0.6));
    plate.brightness = random_.uniform(0.75, 1.25);
    plates_.push_back(plate);
    return plate.code.id;
  }

  void add_bar(const Eigen::Vector3d& a, const Eigen::Vector3d& b, std::vector<FieldBar>& bars) {
    const Eigen::Vector3d up = Eigen::Vector3d(0.0, -0.6, 1.0).normalized();
    const int id_a = add(a, up), id_b = add(b, up);
    bars.push_back({id_a, id_b, (a - b).norm()});
  }

  const FieldPhotosScene& scene_;
  std::vector<TargetCode> codes_;
  std::vector<Plate> plates_;
  Random random_;
  TargetLibrary library_;
};

Scene scene_of(const FieldPhotosScene& field) {
  Scene scene;
  scene.name = "field";
  scene.kind = SceneKind::forge;
  scene.seed = field.seed;
  scene.corruption = 0.0;
  scene.imaging = field.imaging;
  scene.imaging.haze_rms_px = 0.0;
  scene.targets = field.target;
  scene.backdrop = field.backdrop;
  scene.observations.rotations_deg = {0.0};
  for (int k = 0; k < field.photos; ++k) {
    SceneCamera camera;
    camera.model = field.camera;
    camera.model.id = fmt::format("photo{:02}", k);
    scene.cameras.push_back(std::move(camera));
  }
  return scene;
}

}  // namespace

Result<FieldPhotos> lay_out_field(const FieldPhotosScene& field) {
  auto library =
      field.target.library.empty() ? Result<TargetLibrary>(scene_library()) : read_target_library(field.target.library);
  if (!library) return pass_on(library.error());
  FieldPhotos result{scene_of(field), {}, {}};
  FieldBuilder builder(field, std::move(*library));
  auto plates = builder.plates(result.bars);
  if (!plates) return pass_on(plates.error());
  result.layout.plates = std::move(*plates);
  result.layout.poses = builder.walk();
  result.layout.library = std::move(builder).library();
  result.layout.body_poses.resize(1);
  return result;
}

Result<cv::Mat> render_field_photo(const FieldPhotos& photos, int index) {
  if (index < 0 || index >= static_cast<int>(photos.layout.poses.size()))
    return invalid_input("field photographs: there are {}, asked for number {}", photos.layout.poses.size(), index);
  // The nearer plate covers the farther: they are painted from far to near.
  Layout layout = photos.layout;
  const CameraPose& pose = layout.poses[static_cast<std::size_t>(index)];
  std::stable_sort(layout.plates.begin(), layout.plates.end(), [&](const Plate& a, const Plate& b) {
    return pose.cam_from_world(a.center_world_mm).z() > pose.cam_from_world(b.center_world_mm).z();
  });
  return render_targets_on(paint_backdrop(photos.scene, index), photos.scene, layout, index);
}

}  // namespace imprint
