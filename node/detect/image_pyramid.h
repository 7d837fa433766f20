#pragma once

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace imprint {

/// Grey values of a one-channel image, 8 or 16 bit or 32-bit float, between pixels by interpolation. A doubled image
/// has two px of its own to one of the matrix: for dots of few px, whose shape lies between the pixels.
class GreyImage {
 public:
  enum class Size { as_is, doubled };
  explicit GreyImage(cv::Mat image, Size size = Size::as_is)
      : image_(std::move(image)), depth_(image_.depth()), doubled_(size == Size::doubled) {}

  [[nodiscard]] const cv::Mat& mat() const { return image_; }
  [[nodiscard]] int width() const { return doubled_ ? 2 * image_.cols : image_.cols; }
  [[nodiscard]] int height() const { return doubled_ ? 2 * image_.rows : image_.rows; }

  [[nodiscard]] double pixel(int x, int y) const { return doubled_ ? cubic(in_matrix({x, y})) : stored(x, y); }
  /// Whether `at` can be asked for this place.
  [[nodiscard]] bool contains(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d q = doubled_ ? in_matrix(p) : p;
    return q.x() >= 0.0 && q.y() >= 0.0 && q.x() < image_.cols - 1 && q.y() < image_.rows - 1;
  }
  /// Bilinear; cubic where doubled.
  [[nodiscard]] double at(const Eigen::Vector2d& p) const {
    if (doubled_) return cubic(in_matrix(p));
    switch (depth_) {
      case CV_16U:
        return bilinear<std::uint16_t>(p);
      case CV_32F:
        return bilinear<float>(p);
      default:
        return bilinear<std::uint8_t>(p);
    }
  }

 private:
  static Eigen::Vector2d in_matrix(const Eigen::Vector2d& p) { return (p.array() + 0.5) * 0.5 - 0.5; }
  [[nodiscard]] double stored(int x, int y) const {
    switch (depth_) {
      case CV_16U:
        return image_.ptr<std::uint16_t>(y)[x];
      case CV_32F:
        return static_cast<double>(image_.ptr<float>(y)[x]);
      default:
        return image_.ptr<std::uint8_t>(y)[x];
    }
  }
  [[nodiscard]] double cubic(const Eigen::Vector2d& p) const;

  template <class Pixel>
  [[nodiscard]] double bilinear(const Eigen::Vector2d& p) const {
    const int x = static_cast<int>(p.x());
    const int y = static_cast<int>(p.y());
    const double u = p.x() - x;
    const double v = p.y() - y;
    const Pixel* upper = image_.ptr<Pixel>(y) + x;
    const Pixel* lower = image_.ptr<Pixel>(y + 1) + x;
    return (1.0 - v) * ((1.0 - u) * static_cast<double>(upper[0]) + u * static_cast<double>(upper[1])) +
           v * ((1.0 - u) * static_cast<double>(lower[0]) + u * static_cast<double>(lower[1]));
  }

  cv::Mat image_;
  int depth_;
  bool doubled_;
};

/// The image and its halvings, each pixel the mean of four of the level before. Level 0 is the image itself.
class ImagePyramid {
 public:
  /// As many levels as `levels` asks for and the image's size allows.
  ImagePyramid(const cv::Mat& image, int levels);

  [[nodiscard]] int levels() const { return static_cast<int>(levels_.size()); }
  [[nodiscard]] const GreyImage& level(int l) const { return levels_[static_cast<std::size_t>(l)]; }

  /// Px of the image to one of the level; half a px at level -1, the image doubled.
  [[nodiscard]] static double scale(int l) { return std::ldexp(1.0, l); }
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
