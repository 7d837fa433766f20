#include "node/detect/image_pyramid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace imprint {

namespace {

/// Catmull-Rom: through the pixels, exact for slopes and curvature.
std::array<double, 4> cubic_weights(double t) {
  return {((2.0 - t) * t - 1.0) * t / 2.0, ((3.0 * t - 5.0) * t * t + 2.0) / 2.0, ((4.0 - 3.0 * t) * t + 1.0) * t / 2.0,
          (t - 1.0) * t * t / 2.0};
}

template <class Pixel>
double cubic_of(const cv::Mat& image, const Eigen::Vector2d& p) {
  const int x = static_cast<int>(std::floor(p.x()));
  const int y = static_cast<int>(std::floor(p.y()));
  const auto u = cubic_weights(p.x() - x);
  const auto v = cubic_weights(p.y() - y);
  const bool inside = x >= 1 && x + 2 < image.cols;
  double sum = 0.0;
  for (int j = 0; j < 4; ++j) {
    const Pixel* row = image.ptr<Pixel>(std::clamp(y - 1 + j, 0, image.rows - 1));
    double along = 0.0;
    for (int i = 0; i < 4; ++i) {
      const int column = inside ? x - 1 + i : std::clamp(x - 1 + i, 0, image.cols - 1);
      along += u[static_cast<std::size_t>(i)] * static_cast<double>(row[column]);
    }
    sum += v[static_cast<std::size_t>(j)] * along;
  }
  return sum;
}

}  // namespace

double GreyImage::cubic(const Eigen::Vector2d& p) const {
  switch (depth_) {
    case CV_16U:
      return cubic_of<std::uint16_t>(image_, p);
    case CV_32F:
      return cubic_of<float>(image_, p);
    default:
      return cubic_of<std::uint8_t>(image_, p);
  }
}

ImagePyramid::ImagePyramid(const cv::Mat& image, int levels) {
  constexpr int smallest_side_px = 12;  // a target does not fit into less
  levels_.emplace_back(image);
  for (int l = 1; l < levels; ++l) {
    const cv::Mat& last = levels_.back().mat();
    if (std::min(last.cols, last.rows) / 2 < smallest_side_px) break;
    cv::Mat half;
    const cv::Rect even(0, 0, last.cols & ~1, last.rows & ~1);  // so that a level is exactly half of the last
    cv::resize(last(even), half, {}, 0.5, 0.5, cv::INTER_AREA);
    levels_.emplace_back(half);
  }
}

double image_noise(const GreyImage& image) {
  constexpr double places = 30000.0;
  constexpr double mask_norm = 6.0;                 // root of the sum of the mask's squares
  constexpr double sigma_of_median = 1.0 / 0.6745;  // of the absolute value of a normal variable
  const double area = static_cast<double>(image.width()) * image.height();
  const int step = std::max(1, static_cast<int>(std::sqrt(area / places)));
  std::vector<double> responses;
  for (int y = 1; y + 1 < image.height(); y += step) {
    for (int x = 1; x + 1 < image.width(); x += step) {
      const auto row = [&](int v) { return image.pixel(x - 1, v) - 2.0 * image.pixel(x, v) + image.pixel(x + 1, v); };
      responses.push_back(std::abs(row(y - 1) - 2.0 * row(y) + row(y + 1)));
    }
  }
  if (responses.empty()) return 0.0;
  const auto middle = responses.begin() + static_cast<std::ptrdiff_t>(responses.size() / 2);
  std::nth_element(responses.begin(), middle, responses.end());
  return *middle / mask_norm * sigma_of_median;
}

}  // namespace imprint
