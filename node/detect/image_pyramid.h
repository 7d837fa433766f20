#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace imprint {

/// Grey values of a one-channel image of 8 or 16 bit, between pixels by bilinear interpolation.
class GreyImage {
 public:
  explicit GreyImage(cv::Mat image) : image_(std::move(image)), wide_(image_.depth() == CV_16U) {}

  [[nodiscard]] const cv::Mat& mat() const { return image_; }
  [[nodiscard]] int width() const { return image_.cols; }
  [[nodiscard]] int height() const { return image_.rows; }

  [[nodiscard]] double pixel(int x, int y) const {
    return wide_ ? static_cast<double>(image_.ptr<std::uint16_t>(y)[x])
                 : static_cast<double>(image_.ptr<std::uint8_t>(y)[x]);
  }
  /// Whether `bilinear` can be asked for this place.
  [[nodiscard]] bool contains(const Eigen::Vector2d& p) const {
    return p.x() >= 0.0 && p.y() >= 0.0 && p.x() < image_.cols - 1 && p.y() < image_.rows - 1;
  }
  [[nodiscard]] double bilinear(const Eigen::Vector2d& p) const {
    return wide_ ? interpolate<std::uint16_t>(p) : interpolate<std::uint8_t>(p);
  }

 private:
  template <class Pixel>
  [[nodiscard]] double interpolate(const Eigen::Vector2d& p) const {
    const int x = static_cast<int>(p.x());
    const int y = static_cast<int>(p.y());
    const double u = p.x() - x;
    const double v = p.y() - y;
    const Pixel* upper = image_.ptr<Pixel>(y) + x;
    const Pixel* lower = image_.ptr<Pixel>(y + 1) + x;
    return (1.0 - v) * ((1.0 - u) * upper[0] + u * upper[1]) + v * ((1.0 - u) * lower[0] + u * lower[1]);
  }

  cv::Mat image_;
  bool wide_;
};

/// The image and its halvings, each pixel the mean of four of the level before. Level 0 is the image itself.
class ImagePyramid {
 public:
  /// As many levels as `levels` asks for and the image's size allows.
  ImagePyramid(const cv::Mat& image, int levels);

  [[nodiscard]] int levels() const { return static_cast<int>(levels_.size()); }
  [[nodiscard]] const GreyImage& level(int l) const { return levels_[static_cast<std::size_t>(l)]; }

  [[nodiscard]] static double scale(int l) { return static_cast<double>(1 << l); }
  [[nodiscard]] static Eigen::Vector2d to_level(const Eigen::Vector2d& p, int l) {
    return (p.array() + 0.5) / scale(l) - 0.5;
  }
  [[nodiscard]] static Eigen::Vector2d from_level(const Eigen::Vector2d& p, int l) {
    return (p.array() + 0.5) * scale(l) - 0.5;
  }

 private:
  std::vector<GreyImage> levels_;
};

/// Standard deviation of the image's noise in grey levels: the median of a second-difference mask, which neither
/// straight edges nor slopes answer to, over a grid of some 30,000 places. Texture everywhere makes it too large.
double image_noise(const GreyImage& image);

}  // namespace imprint
