#include "tests/paper/targets/degrade.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace imprint::paper {
namespace {

/// Keys' cubic, a = -1/2.
double cubic(double t) {
  const double d = std::abs(t);
  if (d < 1.0) return (1.5 * d - 2.5) * d * d + 1.0;
  if (d < 2.0) return ((-0.5 * d + 2.5) * d - 4.0) * d + 2.0;
  return 0.0;
}

/// Scales the rows' length; the kernel is stretched over the pixels that become one.
cv::Mat scale_rows(const cv::Mat& image, double scale) {
  const int width = std::max(1, static_cast<int>(std::lround(image.cols * scale)));
  cv::Mat result(image.rows, width, CV_32F);
  const double reach = 2.0 / scale;
  for (int x = 0; x < width; ++x) {
    const double center = (x + 0.5) / scale - 0.5;
    const int first = static_cast<int>(std::ceil(center - reach));
    std::vector<float> weights;
    float sum = 0.0F;
    for (int i = first; i <= center + reach; ++i) {
      weights.push_back(static_cast<float>(cubic((i - center) * scale)));
      sum += weights.back();
    }
    for (int y = 0; y < image.rows; ++y) {
      const float* row = image.ptr<float>(y);
      float value = 0.0F;
      for (std::size_t i = 0; i < weights.size(); ++i) {
        value += weights[i] * row[std::clamp(first + static_cast<int>(i), 0, image.cols - 1)];
      }
      result.at<float>(y, x) = value / sum;
    }
  }
  return result;
}

}  // namespace

Sheet scaled(const Sheet& sheet, double x, double y) {
  Sheet result{sheet.image, {}};
  if (x != 1.0) result.image = scale_rows(result.image, x);
  if (y != 1.0) result.image = scale_rows(result.image.t(), y).t();
  for (const auto& [id, center] : sheet.centers) {
    result.centers[id] = {(center.x + 0.5) * x - 0.5, (center.y + 0.5) * y - 0.5};
  }
  return result;
}

Sheet blurred(const Sheet& sheet, double sigma_px) {
  Sheet result{sheet.image, sheet.centers};
  if (sigma_px > 0.0) cv::GaussianBlur(sheet.image, result.image, {}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
  return result;
}

Sheet with_noise(const Sheet& sheet, double sigma, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat noise(sheet.image.size(), CV_32F);
  random.fill(noise, cv::RNG::NORMAL, 0.0, sigma);
  return {sheet.image + noise, sheet.centers};
}

cv::Mat to_8_bit(const Sheet& sheet) {
  cv::Mat grey;
  sheet.image.convertTo(grey, CV_8U, 255.0);
  return grey;
}

}  // namespace imprint::paper
