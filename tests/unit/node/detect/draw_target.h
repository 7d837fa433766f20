#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "lib/targets/target_library.h"

namespace imprint::test {

/// A target as the test wants it drawn. `frame` maps the target's plane (dot radius 1, angles clockwise as seen) to px.
struct DrawnTarget {
  std::uint32_t code = 0;
  int bits = 15;
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  Eigen::Matrix2d frame = Eigen::Matrix2d::Identity();
  double black = 40.0;
  double white = 160.0;

  /// Seen at `tilt_deg` about an axis at `axis_deg`, turned by `turn_deg` in its plane.
  static DrawnTarget seen(std::uint32_t code, const Eigen::Vector2d& center, double radius_px, double turn_deg = 0.0,
                          double tilt_deg = 0.0, double axis_deg = 0.0) {
    const double degree = std::numbers::pi / 180.0;
    const auto turn = [degree](double angle) {
      Eigen::Matrix2d m;
      m << std::cos(angle * degree), -std::sin(angle * degree), std::sin(angle * degree), std::cos(angle * degree);
      return m;
    };
    DrawnTarget target;
    target.code = code;
    target.center = center;
    const Eigen::Vector2d squeeze(1.0, std::cos(tilt_deg * degree));
    target.frame = radius_px * turn(axis_deg) * squeeze.asDiagonal() * turn(turn_deg - axis_deg);
    return target;
  }

  /// 1 where the plane is white: dot within 1, bits between 2 and 3 dot radii.
  [[nodiscard]] bool is_white(const Eigen::Vector2d& in_plane) const {
    const double radius = in_plane.norm();
    if (radius <= 1.0) return true;
    if (radius < 2.0 || radius > 3.0) return false;
    double angle = std::atan2(in_plane.y(), in_plane.x());
    if (angle < 0.0) angle += 2.0 * std::numbers::pi;
    const int bit = static_cast<int>(angle / (2.0 * std::numbers::pi) * bits) % bits;
    return ((code >> (bits - 1 - bit)) & 1U) != 0;
  }
};

/// Draws by `samples` x `samples` samples a pixel into `canvas` (64-bit), a black square of 3.6 radii round the target
/// included.
inline void draw(cv::Mat& canvas, const DrawnTarget& target, int samples = 16) {
  const Eigen::Matrix2d inverse = target.frame.inverse();
  const double reach = 3.6 * (std::abs(target.frame(0, 0)) + std::abs(target.frame(0, 1)) +
                              std::abs(target.frame(1, 0)) + std::abs(target.frame(1, 1)));
  for (int y = std::max(0, static_cast<int>(target.center.y() - reach));
       y < std::min(canvas.rows, static_cast<int>(target.center.y() + reach)); ++y) {
    for (int x = std::max(0, static_cast<int>(target.center.x() - reach));
         x < std::min(canvas.cols, static_cast<int>(target.center.x() + reach)); ++x) {
      if ((inverse * (Eigen::Vector2d(x, y) - target.center)).cwiseAbs().maxCoeff() > 3.5) continue;
      int white = 0;
      for (int j = 0; j < samples; ++j) {
        for (int i = 0; i < samples; ++i) {
          const Eigen::Vector2d p(x + (i + 0.5) / samples - 0.5, y + (j + 0.5) / samples - 0.5);
          white += target.is_white(inverse * (p - target.center)) ? 1 : 0;
        }
      }
      canvas.at<double>(y, x) = target.black + (target.white - target.black) * white / (samples * samples);
    }
  }
}

/// The targets on ground of level 90 as a lens shows them, which blurs before the pixels sample: drawn finer, blurred,
/// then averaged over each pixel. Blurred after the sampling, a centre would move by up to 0.01 px with its phase.
inline cv::Mat draw_through_lens(const std::vector<DrawnTarget>& targets, const cv::Size& size, double blur_px) {
  constexpr int fine = 4;
  cv::Mat canvas(fine * size.height, fine * size.width, CV_64F, cv::Scalar(90.0));
  for (DrawnTarget target : targets) {
    target.center = (target.center.array() + 0.5) * fine - 0.5;
    target.frame *= fine;
    draw(canvas, target, fine);
  }
  if (blur_px > 0.0) cv::GaussianBlur(canvas, canvas, {}, fine * blur_px, fine * blur_px, cv::BORDER_REPLICATE);
  cv::Mat image;
  cv::resize(canvas, image, size, 0.0, 0.0, cv::INTER_AREA);
  return image;
}

/// Blur and noise of the canvas, then whole grey values of `type` (16 bit: 256 times as many).
inline cv::Mat expose(const cv::Mat& canvas, double blur_px, double noise, int type = CV_8U, unsigned seed = 1) {
  cv::Mat image = canvas.clone();
  if (blur_px > 0.0) cv::GaussianBlur(image, image, {}, blur_px, blur_px, cv::BORDER_REPLICATE);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (int y = 0; y < image.rows && noise > 0.0; ++y) {
    for (int x = 0; x < image.cols; ++x) image.at<double>(y, x) += noise * normal(random);
  }
  cv::Mat grey;
  image.convertTo(grey, type, type == CV_16U ? 256.0 : 1.0);
  return grey;
}

}  // namespace imprint::test
