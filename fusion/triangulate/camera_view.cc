#include "fusion/triangulate/camera_view.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/LU>

namespace imprint {
namespace {

using Reason = tl::unexpected<std::string>;

bool well_sized(const ImprintCurve& curve) {
  return curve.offset_px.size() == kImprintStations && curve.weight.size() == kImprintStations;
}

bool is_rotation(const Eigen::Matrix3d& R) {
  return R.allFinite() && (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-4 && R.determinant() > 0.0;
}

Eigen::Vector3d ray_world(const Imprint& imprint, double station_px, double offset_px) {
  const IdealPoint p = imprint.grid.at(station_px, offset_px);
  const Eigen::Vector3d cam(p.x_px, p.y_px, imprint.focal_length_px);
  return imprint.pose.R_cam_world.transpose() * cam.normalized();
}

/// Rays of one curve; what is not finite gets weight 0.
std::vector<CurveRay> rays_of(const Imprint& imprint, const ImprintCurve& curve) {
  std::vector<CurveRay> rays(curve.offset_px.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double weight = curve.weight[i];
    if (!std::isfinite(curve.offset_px[i]) || !(weight > 0.0)) continue;
    rays[i].direction_world = ray_world(imprint, imprint.grid.station_px(i), curve.offset_px[i]);
    rays[i].weight = rays[i].direction_world.allFinite() ? std::min(weight, 1.0) : 0.0;
  }
  return rays;
}

EndRay end_ray(const Imprint& imprint, const ImprintEnd& end) {
  EndRay ray;
  ray.visible = end.visible && std::isfinite(end.station_px) && std::isfinite(end.offset_px);
  if (!ray.visible) return ray;
  ray.direction_world = ray_world(imprint, end.station_px, end.offset_px);
  // A reading that claims to be better than 0.02 px is not believed.
  ray.sigma_px = std::isfinite(end.sigma_px) ? std::max(end.sigma_px, 0.02) : 1.0;
  return ray;
}

std::size_t usable(const std::vector<CurveRay>& rays) {
  return static_cast<std::size_t>(
      std::count_if(rays.begin(), rays.end(), [](const CurveRay& r) { return r.weight > 0.0; }));
}

std::size_t longest_blind_run(const CameraView& view) {
  std::size_t longest = 0, run = 0;
  for (std::size_t i = 0; i < view.upper.size(); ++i) {
    run = view.upper[i].weight > 0.0 || view.lower[i].weight > 0.0 ? 0 : run + 1;
    longest = std::max(longest, run);
  }
  return longest;
}

}  // namespace

tl::expected<CameraView, std::string> view_of(const Imprint& imprint, int camera, double min_rim_share) {
  if (!imprint.failure.empty()) return Reason(imprint.failure);
  if (!(imprint.focal_length_px > 1.0) || !std::isfinite(imprint.focal_length_px))
    return Reason(fmt::format("focal length {} px is not one of a camera", imprint.focal_length_px));
  if (!is_rotation(imprint.pose.R_cam_world) || !imprint.pose.center_world_mm.allFinite())
    return Reason("its pose is not a place and a rotation");
  if (!well_sized(imprint.upper) || !well_sized(imprint.lower) || !well_sized(imprint.axis))
    return Reason(fmt::format("its curves have {}, {} and {} points, {} expected", imprint.upper.offset_px.size(),
                              imprint.lower.offset_px.size(), imprint.axis.offset_px.size(), kImprintStations));
  const StationGrid& grid = imprint.grid;
  const double direction_length = std::hypot(grid.direction_x, grid.direction_y);
  if (!(std::abs(direction_length - 1.0) < 1e-3) || !(std::abs(grid.step_px) > 1e-9) || !std::isfinite(grid.step_px) ||
      !std::isfinite(grid.start_px) || !std::isfinite(grid.origin.x_px) || !std::isfinite(grid.origin.y_px))
    return Reason("the line its stations stand on is not valid");

  CameraView view;
  view.camera = camera;
  view.pose = imprint.pose;
  if (!view.pose.covariance.allFinite() || (view.pose.covariance.diagonal().array() < 0.0).any())
    view.pose.covariance.setZero();
  view.focal_length_px = imprint.focal_length_px;
  view.upper = rays_of(imprint, imprint.upper);
  view.lower = rays_of(imprint, imprint.lower);
  view.axis = rays_of(imprint, imprint.axis);
  view.start = end_ray(imprint, imprint.start);
  view.end = end_ray(imprint, imprint.end);
  const auto needed = static_cast<std::size_t>(std::max(8.0, min_rim_share * static_cast<double>(kImprintStations)));
  const std::size_t upper = usable(view.upper);
  const std::size_t lower = usable(view.lower);
  if (upper < needed || lower < needed)
    return Reason(fmt::format("only {} and {} of {} points of its rims can be trusted, {} of each needed", upper, lower,
                              kImprintStations, needed));
  view.blind_share = static_cast<double>(longest_blind_run(view)) / kImprintStations;
  return view;
}

}  // namespace imprint
