#include "tests/unit/node/segment/drawn_forging.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace imprint::drawn {
namespace {

double soft(double distance_px, double blur_px) { return 0.5 * std::erfc(-distance_px / (blur_px * std::sqrt(2.0))); }

double level_at(const Body& body, double x_px, double y_px) {
  const cv::Vec2d p = body.along_and_across(x_px, y_px);
  const double station = p[0], middle = body.middle_px(station), half = body.half_width_px(station),
               across = p[1] - middle;
  const double bulge = body.end_bulge_px * std::sqrt(std::max(0.0, 1 - across * across / (half * half)));
  const double ahead = station - (body.start_px - bulge), behind = body.end_px + bulge - station;
  const double from_upper = across + half, from_lower = half - across;
  const double s = body.blur_px;
  const double cover = soft(from_upper, s) * soft(from_lower, s) * soft(ahead, s) * soft(behind, s);
  double level = body.level;
  for (const Patch& patch : body.patches) {
    const double depth = patch.depth_px - (patch.upper ? from_upper : from_lower);
    const double share = soft(depth, s) * soft(station - patch.from_px, s) * soft(patch.to_px - station, s);
    level += share * (patch.level - level);
  }
  return body.background + cover * (level - body.background);
}

}  // namespace

ObservedPoint Body::at(double station_px, double offset_px) const {
  const double c = std::cos(tilt_rad), s = std::sin(tilt_rad);
  return {origin.x_px + station_px * c - offset_px * s, origin.y_px + station_px * s + offset_px * c};
}

cv::Vec2d Body::along_and_across(double x_px, double y_px) const {
  const double c = std::cos(tilt_rad), s = std::sin(tilt_rad), x = x_px - origin.x_px, y = y_px - origin.y_px;
  return {x * c + y * s, y * c - x * s};
}

cv::Mat_<float> draw(const Body& body, cv::Size size) {
  cv::Mat_<float> image(size);
  constexpr int kSub = 5;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double a = level_at(body, x - 0.5, y - 0.5), b = level_at(body, x + 0.5, y + 0.5);
      const double c = level_at(body, x + 0.5, y - 0.5), d = level_at(body, x - 0.5, y + 0.5);
      if (std::max({a, b, c, d}) - std::min({a, b, c, d}) < 0.05) {
        image(y, x) = static_cast<float>(0.25 * (a + b + c + d));
        continue;
      }
      double sum = 0;
      for (int i = 0; i < kSub; ++i)
        for (int k = 0; k < kSub; ++k) sum += level_at(body, x - 0.5 + (i + 0.5) / kSub, y - 0.5 + (k + 0.5) / kSub);
      image(y, x) = static_cast<float>(sum / (kSub * kSub));
    }
  }
  return image;
}

void draw_bar(cv::Mat_<float>& image, cv::Rect where, float level) {
  image(where & cv::Rect({}, image.size())).setTo(level);
}

cv::Mat expose(const cv::Mat_<float>& image, double noise, unsigned seed, int depth) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, std::max(noise, 1e-12));
  const double gain = depth == CV_16U ? 257.0 : 1.0;
  cv::Mat_<double> noisy(image.size());
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) noisy(y, x) = gain * (image(y, x) + (noise > 0 ? normal(random) : 0.0));
  cv::Mat out;
  noisy.convertTo(out, depth);  // rounds and saturates
  return out;
}

}  // namespace imprint::drawn
