#include "simulation/frame_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "simulation/coverage.h"
#include "simulation/haze.h"
#include "simulation/plate_painter.h"
#include "simulation/props.h"
#include "simulation/random.h"
#include "simulation/sensor.h"
#include "simulation/silhouette_outline.h"
#include "simulation/sparks.h"
#include "simulation/surface_shader.h"

namespace imprint {
namespace {

constexpr double outline_spacing_px = 0.125;  // chords leave the steps' roundings by less than 0.0005 px
constexpr int ray_grid_px = 16;               // distortion bends less than 0.001 px over this

// Directions of the lines of sight in the body's frame, exact every ray_grid_px and linear between.
class BodyRays {
 public:
  BodyRays(const CameraModel& camera, const Eigen::Matrix3d& R_cam_body, cv::Rect region)
      : region_(region), columns_(region.width / ray_grid_px + 2) {
    const int rows = region.height / ray_grid_px + 2;
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns_; ++i) {
        const IdealPoint p = undistort(
            camera, {region.x + static_cast<double>(i) * ray_grid_px, region.y + static_cast<double>(j) * ray_grid_px});
        nodes_.emplace_back(R_cam_body.transpose() * Eigen::Vector3d(p.x_px, p.y_px, camera.focal_length_px));
      }
    }
  }

  [[nodiscard]] Eigen::Vector3d at(int x, int y) const {
    const int i = (x - region_.x) / ray_grid_px, j = (y - region_.y) / ray_grid_px;
    const double u = static_cast<double>((x - region_.x) % ray_grid_px) / ray_grid_px;
    const double v = static_cast<double>((y - region_.y) % ray_grid_px) / ray_grid_px;
    const auto node = [&](int a, int b) -> const Eigen::Vector3d& {
      return nodes_[static_cast<std::size_t>(b * columns_ + a)];
    };
    return (1 - v) * ((1 - u) * node(i, j) + u * node(i + 1, j)) +
           v * ((1 - u) * node(i, j + 1) + u * node(i + 1, j + 1));
  }

 private:
  cv::Rect region_;
  int columns_;
  std::vector<Eigen::Vector3d> nodes_;
};

void displace(std::vector<ObservedPoint>& points, const Haze& haze) {
  for (ObservedPoint& p : points) {
    const ObservedPoint by = haze.at(p);
    p = {p.x_px + by.x_px, p.y_px + by.y_px};
  }
}

// Lays the body over the image by its coverage and returns its own light (region as the coverage).
cv::Mat lay_body(const Scene& scene, const Layout& layout, int observation, int camera, const Coverage& coverage,
                 cv::Mat& image) {
  const CameraPose& pose = layout.poses[static_cast<std::size_t>(camera)];
  const BodyPose& body_pose = layout.body_poses[static_cast<std::size_t>(observation)];
  const SurfaceShader shader(scene, layout);
  const Eigen::Vector3d center = body_pose.body_from_world(pose.center_world_mm);
  const BodyRays rays(scene.cameras[static_cast<std::size_t>(camera)].model, pose.R_cam_world * body_pose.R_world_body,
                      coverage.region);
  cv::Mat light(coverage.region.size(), CV_32F, cv::Scalar(0.0));
  for (int j = 0; j < light.rows; ++j) {
    const int y = coverage.region.y + j;
    const auto* share = coverage.share.ptr<double>(j);
    float* row = image.ptr<float>(y) + coverage.region.x;
    for (int i = 0; i < light.cols; ++i) {
      if (share[i] <= 0.0) continue;
      const SurfaceHit hit = meet_surface(shader, layout.body.length_mm(), center, rays.at(coverage.region.x + i, y));
      const double level = shader.level(hit.x_mm, hit.phi, hit.radius_mm, hit.facing);
      light.at<float>(j, i) = static_cast<float>(share[i] * level);
      row[i] = static_cast<float>((1.0 - share[i]) * static_cast<double>(row[i]) + share[i] * level);
    }
  }
  return light;
}

// Light spread widely by optics and hot dust round the glowing body.
void add_halo(const Scene& scene, const cv::Mat& light, cv::Rect region, cv::Mat& image) {
  const double share = scene.surface.halo;
  if (share <= 0.0 || scene.kind != SceneKind::forge) return;
  constexpr int shrink = 16;
  const int columns = (image.cols + shrink - 1) / shrink, rows = (image.rows + shrink - 1) / shrink;
  cv::Mat small(rows, columns, CV_32F, cv::Scalar(0.0));
  for (int j = 0; j < light.rows; ++j) {
    for (int i = 0; i < light.cols; ++i) {
      small.at<float>((region.y + j) / shrink, (region.x + i) / shrink) += light.at<float>(j, i) / (shrink * shrink);
    }
  }
  const double sigma = 0.02 * image.cols / shrink;
  cv::Mat narrow, wide, halo;
  cv::GaussianBlur(small, narrow, {}, sigma, sigma, cv::BORDER_CONSTANT);
  cv::GaussianBlur(small, wide, {}, 4.0 * sigma, 4.0 * sigma, cv::BORDER_CONSTANT);
  cv::resize(share * (narrow + 1.5 * wide), halo, image.size(), 0, 0, cv::INTER_LINEAR);
  image += halo;
}

void blur(double sigma_px, cv::Mat& image) {
  if (sigma_px <= 0.0) return;
  const int reach = std::max(1, static_cast<int>(std::ceil(4.5 * sigma_px)));
  cv::GaussianBlur(image, image, {2 * reach + 1, 2 * reach + 1}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
}

}  // namespace

Result<cv::Mat> render_frame_on(const cv::Mat& backdrop, const Scene& scene, const Layout& layout, int observation,
                                int camera) {
  const CameraModel& model = scene.cameras[static_cast<std::size_t>(camera)].model;
  const auto outline = body_outline(layout.body, layout.body_poses[static_cast<std::size_t>(observation)], model,
                                    layout.poses[static_cast<std::size_t>(camera)], outline_spacing_px);
  if (!outline) return pass_on(outline.error());
  const Haze haze(scene, layout, observation, camera);
  cv::Mat image = backdrop.clone();
  paint_plates(scene, layout, camera, haze, image);
  const auto props = props_of(scene, layout, observation, camera);
  paint_props(props, false, image);
  auto polygon = outline->polygon();
  displace(polygon, haze);
  const Coverage coverage = polygon_coverage(polygon, image.size());
  if (scene.forging.present && !coverage.region.empty()) {
    const cv::Mat light = lay_body(scene, layout, observation, camera, coverage, image);
    add_halo(scene, light, coverage.region, image);
    add_sparks(scene, *outline, observation, camera, image);
  }
  paint_props(props, true, image);
  blur(scene.imaging.blur_sigma_px, image);
  return expose(
      scene.imaging,
      stream_seed(scene.seed, "sensor", static_cast<std::uint64_t>(observation), static_cast<std::uint64_t>(camera)),
      image);
}

cv::Mat render_targets_on(const cv::Mat& backdrop, const Scene& scene, const Layout& layout, int camera) {
  cv::Mat image = backdrop.clone();
  paint_plates(scene, layout, camera, Haze(scene, layout, 0, camera), image);
  blur(scene.imaging.blur_sigma_px, image);
  return expose(scene.imaging, stream_seed(scene.seed, "sensor", 0, static_cast<std::uint64_t>(camera)), image);
}

}  // namespace imprint
