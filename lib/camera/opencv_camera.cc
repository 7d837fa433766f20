#include "lib/camera/opencv_camera.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/LU>
#include <Eigen/QR>

namespace imprint {
namespace {

// One ray, as (x, y, 1), and where the camera to be fitted should show it.
struct RaySample {
  Eigen::Vector2d direction, seen_px;
};

constexpr int kColumns = 25, kRows = 19;  // dense enough for a polynomial of degree 7

template <class RayOf>
std::optional<std::vector<RaySample>> sample_image(int width_px, int height_px, RayOf ray_of) {
  std::vector<RaySample> samples;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Eigen::Vector2d px((width_px - 1) * column / (kColumns - 1.0), (height_px - 1) * row / (kRows - 1.0));
      const std::optional<Eigen::Vector2d> direction = ray_of(px);
      if (!direction) return std::nullopt;
      samples.push_back({*direction, px});
    }
  }
  return samples;
}

// Gauss-Newton with numerical derivatives: the parameters are of order 1 or below, the residuals in px.
// Gives the largest distance left.
template <class Show>
double fit(Eigen::VectorXd& parameters, const std::vector<RaySample>& samples, Show show) {
  const auto residuals = [&](const Eigen::VectorXd& at) {
    Eigen::VectorXd r(2 * static_cast<Eigen::Index>(samples.size()));
    for (std::size_t i = 0; i < samples.size(); ++i)
      r.segment<2>(2 * static_cast<Eigen::Index>(i)) = show(at, samples[i].direction) - samples[i].seen_px;
    return r;
  };
  Eigen::VectorXd r = residuals(parameters);
  for (int iteration = 0; iteration < 20; ++iteration) {
    Eigen::MatrixXd j(r.size(), parameters.size());
    for (Eigen::Index k = 0; k < parameters.size(); ++k) {
      constexpr double kStep = 1e-5;
      Eigen::VectorXd ahead = parameters, behind = parameters;
      ahead[k] += kStep;
      behind[k] -= kStep;
      j.col(k) = (residuals(ahead) - residuals(behind)) / (2.0 * kStep);
    }
    const Eigen::VectorXd next = parameters - j.colPivHouseholderQr().solve(r);
    const Eigen::VectorXd then = residuals(next);
    if (!next.allFinite() || !(then.squaredNorm() < r.squaredNorm())) break;
    parameters = next;
    r = then;
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i)
    largest = std::max(largest, r.segment<2>(2 * static_cast<Eigen::Index>(i)).norm());
  return largest;
}

double normalizer(const OpenCvCamera& camera) { return 0.5 * std::min(camera.width_px, camera.height_px); }

// The direction that OpenCV's camera shows at `px`, by Newton's method.
std::optional<Eigen::Vector2d> ray_of(const OpenCvCamera& camera, const Eigen::Vector2d& px) {
  const auto shown = [&](const Eigen::Vector2d& d) {
    const ObservedPoint p = project(camera, d.x(), d.y());
    return Eigen::Vector2d(p.x_px, p.y_px);
  };
  Eigen::Vector2d d((px.x() - camera.cx_px) / camera.fx_px, (px.y() - camera.cy_px) / camera.fy_px);
  for (int iteration = 0; iteration < 50; ++iteration) {
    const Eigen::Vector2d off = px - shown(d);
    constexpr double kStep = 1e-6;
    Eigen::Matrix2d j;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d side = kStep * Eigen::Vector2d::Unit(k);
      j.col(k) = (shown(d + side) - shown(d - side)) / (2.0 * kStep);
    }
    // Turned over: behind the fold of the polynomial, where rays come back to pixels that have one already.
    if (!(j.determinant() > 0.0)) return std::nullopt;
    if (off.norm() < 1e-8) return d;
    d += j.inverse() * off;
  }
  return std::nullopt;
}

CameraModel balanced_of(const Eigen::VectorXd& p, CameraModel camera) {
  const double n = camera.normalizer_px();
  camera.focal_length_px = n * p[0];
  camera.principal_point = {n * p[1], n * p[2]};
  std::copy_n(p.data() + 3, 3, camera.distortion.radial.begin());
  std::copy_n(p.data() + 6, 2, camera.distortion.tangential.begin());
  std::copy_n(p.data() + 8, 2, camera.distortion.affine.begin());
  return camera;
}

OpenCvCamera opencv_of(const Eigen::VectorXd& p, OpenCvCamera camera) {
  const double n = normalizer(camera);
  camera.fx_px = n * p[0];
  camera.fy_px = n * p[1];
  camera.cx_px = n * p[2];
  camera.cy_px = n * p[3];
  std::copy_n(p.data() + 4, 5, camera.distortion.begin());
  return camera;
}

}  // namespace

ObservedPoint project(const OpenCvCamera& camera, double x, double y) {
  const auto& [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4] = camera.distortion;
  const double r2 = x * x + y * y;
  const double radial = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)));
  const double xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + r2 * s2);
  const double yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + r2 * s4);
  return {camera.fx_px * xd + camera.cx_px, camera.fy_px * yd + camera.cy_px};
}

OpenCvConversion to_opencv(const CameraModel& camera) {
  const double n = camera.normalizer_px(), f = camera.focal_length_px, g = f / n;
  const BalancedDistortion& d = camera.distortion;
  const double q = d.r0 * d.r0;
  const double k = 1.0 - q * (d.radial[0] + q * (d.radial[1] + q * d.radial[2]));
  Eigen::VectorXd start(9);
  start << g * (k + d.affine[0]), g * k, camera.principal_point.x_px / n, camera.principal_point.y_px / n,
      d.radial[0] * g * g / k, d.radial[1] * std::pow(g, 4) / k, d.tangential[1] * g / k, d.tangential[0] * g / k,
      d.radial[2] * std::pow(g, 6) / k;
  const auto samples =
      sample_image(camera.width_px, camera.height_px, [&](const Eigen::Vector2d& px) -> std::optional<Eigen::Vector2d> {
        const IdealPoint p = undistort(camera, {px.x(), px.y()});
        return Eigen::Vector2d(p.x_px / f, p.y_px / f);
      });
  OpenCvConversion result;
  result.camera.width_px = camera.width_px;
  result.camera.height_px = camera.height_px;
  result.max_error_px = fit(start, *samples, [&](const Eigen::VectorXd& p, const Eigen::Vector2d& ray) {
    const ObservedPoint at = project(opencv_of(p, result.camera), ray.x(), ray.y());
    return Eigen::Vector2d(at.x_px, at.y_px);
  });
  result.camera = opencv_of(start, result.camera);
  return result;
}

Result<BalancedConversion> from_opencv(const OpenCvCamera& camera) {
  BalancedConversion result;
  result.camera.width_px = camera.width_px;
  result.camera.height_px = camera.height_px;
  const double n = normalizer(camera);
  const double q = result.camera.distortion.r0 * result.camera.distortion.r0;
  const auto& c = camera.distortion;
  // f K = F fixes f, as K = 1 / (1 + sum k_i (q / g^2)^i) depends on it.
  const double plain = camera.fy_px / n;
  double g = plain, k = 1.0;
  for (int iteration = 0; iteration < 50; ++iteration) {
    const double s = q / (g * g);
    k = 1.0 / (1.0 + s * (c[0] + s * (c[1] + s * c[4])));
    if (!(k > 0.1 && k < 10.0)) k = 1.0;  // far from a lens: let the fit find it
    g = plain / k;
  }
  Eigen::VectorXd start(10);
  start << g, camera.cx_px / n, camera.cy_px / n, c[0] * k / (g * g), c[1] * k / std::pow(g, 4),
      c[4] * k / std::pow(g, 6), c[3] * k / g, c[2] * k / g, (camera.fx_px / camera.fy_px - 1.0) * k, 0.0;
  const auto samples =
      sample_image(camera.width_px, camera.height_px, [&](const Eigen::Vector2d& px) { return ray_of(camera, px); });
  if (!samples)
    return invalid_input(
        "the distortion coefficients fold the image over within its {} x {} px: some pixels have no ray, or two; "
        "check the coefficients and the image size",
        camera.width_px, camera.height_px);
  result.max_error_px = fit(start, *samples, [&](const Eigen::VectorXd& p, const Eigen::Vector2d& ray) {
    const CameraModel fitted = balanced_of(p, result.camera);
    const ObservedPoint at = project(fitted, {ray.x(), ray.y(), 1.0});
    return Eigen::Vector2d(at.x_px, at.y_px);
  });
  result.camera = balanced_of(start, result.camera);
  return result;
}

}  // namespace imprint
