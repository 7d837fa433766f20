#include "node/detect/sharpen.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace imprint {
namespace {

constexpr int reach_px = 11;

double grey(const cv::Mat& image, int x, int y) {
  return image.depth() == CV_16U ? image.ptr<std::uint16_t>(y)[x] : image.ptr<std::uint8_t>(y)[x];
}

double upper_percentile(std::vector<double>& values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(static_cast<double>(values.size() - 1) * (1.0 - share));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The inverse of a Gaussian of `blur_px` along one axis, its gain at most 1 / (2 sqrt(floor)).
cv::Mat inverse_kernel(double blur_px, double floor) {
  constexpr int steps = 256;
  cv::Mat kernel(2 * reach_px + 1, 1, CV_64F);
  for (int x = -reach_px; x <= reach_px; ++x) {
    double sum = 0.0;
    for (int k = 0; k < steps; ++k) {
      const double frequency = 0.5 * (k + 0.5) / steps;  // cycles per px
      const double exponent = std::numbers::pi * blur_px * frequency;
      const double passed = std::exp(-2.0 * exponent * exponent);
      sum += passed / (passed * passed + floor) * std::cos(2.0 * std::numbers::pi * frequency * x) / steps;
    }
    const double fade = std::cos(0.5 * std::numbers::pi * x / (reach_px + 1));
    kernel.at<double>(x + reach_px) = sum * fade * fade;
  }
  return kernel / cv::sum(kernel)[0];
}

}  // namespace

double edge_blur_px(const cv::Mat& image, double noise) {
  constexpr double places = 40000.0;
  constexpr double share = 0.004;
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(image.total()) / places)));
  std::vector<double> slopes;
  std::vector<double> curvatures;
  for (int y = 1; y + 1 < image.rows; y += step) {
    for (int x = 1; x + 1 < image.cols; x += step) {
      const double here = grey(image, x, y);
      const double left = grey(image, x - 1, y), right = grey(image, x + 1, y);
      const double above = grey(image, x, y - 1), below = grey(image, x, y + 1);
      slopes.push_back(0.5 * std::max(std::abs(right - left), std::abs(below - above)));
      curvatures.push_back(std::max(std::abs(left - 2.0 * here + right), std::abs(above - 2.0 * here + below)));
    }
  }
  if (slopes.size() < 100) return 0.0;
  const double slope = upper_percentile(slopes, share);
  const double curvature = upper_percentile(curvatures, share);
  constexpr double clear = 4.0;  // standard deviations
  if (slope < clear * noise) return 0.0;
  return slope / std::max(curvature, 1e-3 * slope) / std::exp(0.5);
}

std::optional<SharpenedImage> sharpen(const cv::Mat& image, double blur_px, double noise, double allowed_noise) {
  for (const double floor : {1e-4, 1e-3, 1e-2}) {
    const cv::Mat kernel = inverse_kernel(blur_px, floor);
    SharpenedImage result;
    result.noise_gain = kernel.dot(kernel);  // of both axes: the square of one axis's root
    if (result.noise_gain * noise > allowed_noise) continue;
    cv::sepFilter2D(image, result.image, CV_32F, kernel, kernel, {-1, -1}, 0.0, cv::BORDER_REPLICATE);
    return result;
  }
  return std::nullopt;
}

}  // namespace imprint
