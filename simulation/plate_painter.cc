#include "simulation/plate_painter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "simulation/random.h"
#include "simulation/texture.h"

namespace imprint {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int subsamples = 12;        // along each side of a pixel that holds an edge: 144 samples
constexpr double black_share = 0.11;  // of printed black against printed white

// What is printed on one plate, in mm of its own plane.
class PlateFace {
 public:
  PlateFace(const Scene& scene, const Layout& layout, const Plate& plate)
      : plate_(plate),
        bits_(layout.library.bits),
        dot_(0.5 * scene.targets.dot_diameter_mm),
        half_(0.5 * scene.targets.plate_mm) {
    const TargetGeometry& geometry = layout.library.geometry;
    inner_ = dot_ * geometry.ring_inner_radius / geometry.dot_radius;
    outer_ = dot_ * geometry.ring_outer_radius / geometry.dot_radius;
    white_ = scene.targets.white_level * plate.brightness;
    unevenness_ = 0.06 * std::min(1.0, scene.corruption);
    seed_ = stream_seed(scene.seed, "dirt", static_cast<std::uint64_t>(plate.code.id));
  }

  [[nodiscard]] bool inside(const Eigen::Vector2d& p) const {
    return std::abs(p.x()) <= half_ && std::abs(p.y()) <= half_;
  }

  // Distance to the nearest line between two greys, or less.
  [[nodiscard]] double edge_distance(const Eigen::Vector2d& p) const {
    const double r = p.norm();
    double nearest =
        std::min({std::abs(r - dot_), std::abs(r - inner_), std::abs(r - outer_), std::abs(std::abs(p.x()) - half_),
                  std::abs(std::abs(p.y()) - half_), std::abs(corner_distance(p) - corner_radius()),
                  std::abs(p.dot(plate_.cover_direction) - plate_.cover_mm)});
    if (r > 0.5 * inner_ && r < 1.5 * outer_) {
      const double sector = angle(p) / (2.0 * pi) * bits_;
      nearest = std::min(nearest, std::abs(sector - std::round(sector)) * 2.0 * pi / bits_ * r);
    }
    return nearest;
  }

  [[nodiscard]] double print(const Eigen::Vector2d& p) const {
    if (plate_.state == PlateState::hidden && p.dot(plate_.cover_direction) > plate_.cover_mm) return 0.35 * white_;
    const double r = p.norm();
    bool white = r < dot_ || corner_distance(p) < corner_radius();
    if (r >= inner_ && r < outer_) {
      const int sector = std::min(static_cast<int>(angle(p) / (2.0 * pi) * bits_), bits_ - 1);
      white = (plate_.code.code >> (bits_ - 1 - sector) & 1U) != 0;
    }
    return white ? white_ : black_share * white_;
  }

  // Smooth enough to be looked up once a pixel.
  [[nodiscard]] double soil(const Eigen::Vector2d& p, double printed) const {
    const Eigen::Vector3d at(p.x() / dot_, p.y() / dot_, 0.0);
    const double shade = printed * (1.0 + unevenness_ * value_noise(seed_, 0.5 * at));
    if (plate_.state != PlateState::dirty) return shade;
    const double blot = std::clamp(4.0 * (fractal_noise(seed_ + 100, 0.9 * at, 4, 0.55) - 0.08), 0.0, 1.0);
    return shade + 0.75 * blot * (0.3 * white_ - shade);
  }

 private:
  static double angle(const Eigen::Vector2d& p) {
    const double a = std::atan2(p.y(), p.x());
    return a < 0.0 ? a + 2.0 * pi : a;
  }
  // The small round marks in the corners, as on the hybrid targets of [B].
  [[nodiscard]] double corner_distance(const Eigen::Vector2d& p) const {
    return std::hypot(std::abs(p.x()) - 0.84 * half_, std::abs(p.y()) - 0.84 * half_);
  }
  [[nodiscard]] double corner_radius() const { return 0.18 * dot_; }

  const Plate& plate_;
  int bits_;
  double dot_, half_, inner_ = 0.0, outer_ = 0.0, white_ = 0.0;
  double unevenness_ = 0.0;
  std::uint64_t seed_ = 0;
};

// Plate coordinates of what the camera shows at an observed point.
class PlateView {
 public:
  PlateView(const Plate& plate, const CameraModel& camera, const CameraPose& pose, const Haze& haze)
      : camera_(camera),
        haze_(haze),
        R_plate_cam_((pose.R_cam_world * plate.R_world_plate).transpose()),
        center_plate_(plate.R_world_plate.transpose() * (pose.center_world_mm - plate.center_world_mm)) {}

  [[nodiscard]] Eigen::Vector2d on_plate(const ObservedPoint& p) const {
    const ObservedPoint moved = haze_.at(p);
    const IdealPoint ideal = undistort(camera_, {p.x_px - moved.x_px, p.y_px - moved.y_px});
    const Eigen::Vector3d ray = R_plate_cam_ * Eigen::Vector3d(ideal.x_px, ideal.y_px, camera_.focal_length_px);
    return (center_plate_ - ray * (center_plate_.z() / ray.z())).head<2>();
  }

 private:
  const CameraModel& camera_;
  const Haze& haze_;
  Eigen::Matrix3d R_plate_cam_;
  Eigen::Vector3d center_plate_;
};

cv::Rect plate_region(const Plate& plate, double plate_mm, const CameraModel& camera, const CameraPose& pose) {
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector3d p_plate((corner % 2 - 0.5) * plate_mm, (corner / 2 - 0.5) * plate_mm, 0.0);
    const Eigen::Vector3d p = pose.cam_from_world(plate.center_world_mm + plate.R_world_plate * p_plate);
    if (p.z() <= 0.1 * plate_mm) return {};
    const ObservedPoint seen = project(camera, p);
    left = std::min(left, seen.x_px);
    right = std::max(right, seen.x_px);
    top = std::min(top, seen.y_px);
    bottom = std::max(bottom, seen.y_px);
  }
  constexpr double margin_px = 4.0;  // haze moves the borders
  if (!(right > -1e4 && left < 1e5 && bottom > -1e4 && top < 1e5)) return {};
  const cv::Rect box(cv::Point(static_cast<int>(left - margin_px), static_cast<int>(top - margin_px)),
                     cv::Point(static_cast<int>(right + margin_px), static_cast<int>(bottom + margin_px)));
  return box & cv::Rect(0, 0, camera.width_px, camera.height_px);
}

// Mean grey of one pixel given the plate coordinates of its four corners; `behind` shows beside the plate.
double pixel_mean(const PlateFace& face, const std::array<Eigen::Vector2d, 4>& corner, double behind) {
  const Eigen::Vector2d middle = 0.25 * (corner[0] + corner[1] + corner[2] + corner[3]);
  const double reach = 0.75 * std::max((corner[3] - corner[0]).norm(), (corner[2] - corner[1]).norm());
  if (face.edge_distance(middle) > reach) return face.inside(middle) ? face.soil(middle, face.print(middle)) : behind;
  double sum = 0.0;
  for (int j = 0; j < subsamples; ++j) {
    const double v = (j + 0.5) / subsamples;
    const Eigen::Vector2d left = corner[0] + v * (corner[2] - corner[0]),
                          right = corner[1] + v * (corner[3] - corner[1]);
    for (int i = 0; i < subsamples; ++i) {
      const Eigen::Vector2d p = left + (i + 0.5) / subsamples * (right - left);
      sum += face.inside(p) ? face.print(p) : behind;
    }
  }
  const double mean = sum / (subsamples * subsamples);
  return face.inside(middle) ? face.soil(middle, mean) : mean;
}

void paint_plate(const Scene& scene, const Layout& layout, const Plate& plate, int camera, const Haze& haze,
                 cv::Mat& image) {
  const CameraModel& model = scene.cameras[static_cast<std::size_t>(camera)].model;
  const CameraPose& pose = layout.poses[static_cast<std::size_t>(camera)];
  const cv::Rect region = plate_region(plate, scene.targets.plate_mm, model, pose);
  if (region.empty()) return;
  const PlateFace face(scene, layout, plate);
  const PlateView view(plate, model, pose, haze);
  const auto border_row = [&](int y) {
    std::vector<Eigen::Vector2d> row;
    for (int x = region.x; x <= region.x + region.width; ++x) row.push_back(view.on_plate({x - 0.5, y - 0.5}));
    return row;
  };
  auto above = border_row(region.y);
  for (int y = region.y; y < region.y + region.height; ++y) {
    auto below = border_row(y + 1);
    float* pixels = image.ptr<float>(y) + region.x;
    for (std::size_t i = 0; i + 1 < above.size(); ++i) {
      pixels[i] = static_cast<float>(pixel_mean(face, {above[i], above[i + 1], below[i], below[i + 1]}, pixels[i]));
    }
    above = std::move(below);
  }
}

}  // namespace

void paint_plates(const Scene& scene, const Layout& layout, int camera, const Haze& haze, cv::Mat& image) {
  constexpr double grazing = 0.1;  // seen at more than 84 deg a plate is a line
  for (const Plate& plate : layout.plates) {
    if (plate_facing(plate, layout.poses[static_cast<std::size_t>(camera)]) > grazing) {
      paint_plate(scene, layout, plate, camera, haze, image);
    }
  }
}

DotImage dot_image(const Plate& plate, double dot_diameter_mm, const CameraModel& camera, const CameraPose& pose) {
  DotImage dot;
  dot.center = project(camera, pose.cam_from_world(plate.center_world_mm));
  // Area and centroid of the dot's image as a polygon; 720 corners leave 1e-5 of the area.
  constexpr int corners = 720;
  double area = 0.0, mx = 0.0, my = 0.0;
  const auto corner = [&](int i) {
    const double a = 2.0 * pi * i / corners;
    const Eigen::Vector3d on_plate(0.5 * dot_diameter_mm * std::cos(a), 0.5 * dot_diameter_mm * std::sin(a), 0.0);
    const ObservedPoint p =
        project(camera, pose.cam_from_world(plate.center_world_mm + plate.R_world_plate * on_plate));
    return Eigen::Vector2d(p.x_px - dot.center.x_px, p.y_px - dot.center.y_px);
  };
  Eigen::Vector2d a = corner(0);
  for (int i = 1; i <= corners; ++i) {
    const Eigen::Vector2d b = corner(i % corners);
    const double cross = a.x() * b.y() - a.y() * b.x();
    area += 0.5 * cross;
    mx += cross * (a.x() + b.x()) / 6.0;
    my += cross * (a.y() + b.y()) / 6.0;
    a = b;
  }
  dot.ellipse_center = {dot.center.x_px + mx / area, dot.center.y_px + my / area};
  dot.diameter_px = 2.0 * std::sqrt(std::abs(area) / pi);
  return dot;
}

}  // namespace imprint
