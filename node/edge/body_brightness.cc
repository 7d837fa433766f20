#include "node/edge/body_brightness.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace imprint {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

float quantile(std::vector<float>& values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

float grey_at(const cv::Mat& image, const ObservedPoint& p, Polarity polarity) {
  const int x = static_cast<int>(std::lround(p.x_px)), y = static_cast<int>(std::lround(p.y_px));
  if (x < 0 || y < 0 || x >= image.cols || y >= image.rows) return -1.0F;
  const float value = image.depth() == CV_16U ? static_cast<float>(image.at<unsigned short>(y, x)) / 65535.0F
                                              : static_cast<float>(image.at<unsigned char>(y, x)) / 255.0F;
  return polarity == Polarity::dark ? 1.0F - value : value;
}

std::vector<float> body_brightness(const cv::Mat& image, const SilhouetteFrame& frame, int first_station_px,
                                   const std::vector<double>& upper_offset_px,
                                   const std::vector<double>& lower_offset_px, Polarity polarity) {
  constexpr std::size_t kEvery = 4, kHalf = 15;  // stations; sections on either side: longer than most patches of scale
  constexpr int kAcross = 10;
  const std::size_t n = upper_offset_px.size();
  std::vector<float> sections, values, window;
  for (std::size_t i = 0; i < n; i += kEvery) {
    const double upper = upper_offset_px[i], lower = lower_offset_px[i], middle = 0.5 * (upper + lower);
    values.clear();
    for (int k = -kAcross; k <= kAcross && !std::isnan(middle); ++k) {
      const double offset = middle + 0.3 * k / kAcross * (lower - upper);
      const float value = grey_at(image, frame.at(first_station_px + static_cast<double>(i), offset), polarity);
      if (value >= 0) values.push_back(value);
    }
    sections.push_back(values.empty() ? kUnknown : quantile(values, 0.75));
  }
  std::vector<float> brightness(n, kUnknown);
  for (std::size_t s = 0; s < sections.size(); ++s) {
    window.clear();
    for (std::size_t k = s > kHalf ? s - kHalf : 0; k <= std::min(sections.size() - 1, s + kHalf); ++k)
      if (!std::isnan(sections[k])) window.push_back(sections[k]);
    const float value = window.empty() ? kUnknown : quantile(window, 0.5);
    std::fill(brightness.begin() + static_cast<std::ptrdiff_t>(s * kEvery),
              brightness.begin() + static_cast<std::ptrdiff_t>(std::min(n, (s + 1) * kEvery)), value);
  }
  return brightness;
}

}  // namespace imprint
