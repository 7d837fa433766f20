#include "simulation/sparks.h"

#include <algorithm>
#include <cmath>

#include "simulation/random.h"

namespace imprint {
namespace {

// A round Gaussian spot of the given total light.
void add_spot(cv::Mat& image, double x_px, double y_px, double sigma_px, double light) {
  const int reach = static_cast<int>(std::ceil(4.0 * sigma_px));
  const int cx = static_cast<int>(std::lround(x_px)), cy = static_cast<int>(std::lround(y_px));
  for (int y = std::max(0, cy - reach); y <= std::min(image.rows - 1, cy + reach); ++y) {
    for (int x = std::max(0, cx - reach); x <= std::min(image.cols - 1, cx + reach); ++x) {
      const double r2 = (x - x_px) * (x - x_px) + (y - y_px) * (y - y_px);
      image.at<float>(y, x) += static_cast<float>(light / (6.283185307179586 * sigma_px * sigma_px) *
                                                  std::exp(-0.5 * r2 / (sigma_px * sigma_px)));
    }
  }
}

}  // namespace

void add_sparks(const Scene& scene, const BodyOutline& outline, int observation, int camera, cv::Mat& image) {
  if (scene.kind != SceneKind::forge) return;
  Random random(
      stream_seed(scene.seed, "sparks", static_cast<std::uint64_t>(observation), static_cast<std::uint64_t>(camera)));
  const int count = static_cast<int>(std::lround(scene.corruption * scene.surface.sparks));
  const double unit = image.cols / 4656.0;
  const int rim_points = static_cast<int>(outline.upper.size());
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(random.index(rim_points));
    const double across = random.uniform(-0.6, 1.6);
    double x = outline.upper[at].x_px + random.normal() * 200.0 * unit;
    double y = outline.upper[at].y_px + across * (outline.lower[at].y_px - outline.upper[at].y_px);
    double angle = random.angle_rad();
    const double length = random.uniform(3.0, 45.0) * std::max(unit, 0.3), sigma = random.uniform(0.5, 1.1);
    const double brightness = random.uniform(0.15, 1.2), bend = random.normal() * 0.01;
    for (double s = 0.0; s < length; s += 0.5) {
      const double fade = 1.0 - 0.8 * s / length;
      add_spot(image, x, y, sigma, 0.5 * brightness * fade * 2.5 * sigma);
      x += 0.5 * std::cos(angle);
      y += 0.5 * std::sin(angle);
      angle += bend;
    }
  }
}

}  // namespace imprint
