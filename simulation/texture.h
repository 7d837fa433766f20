#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace imprint {

/// Smooth noise in space, about -1 to 1, features of size 1; the same for the same seed and point.
double value_noise(std::uint64_t seed, const Eigen::Vector3d& p);

/// Octaves of value_noise, each of half the size and `gain` times the strength of the one before; about -1 to 1.
double fractal_noise(std::uint64_t seed, const Eigen::Vector3d& p, int octaves, double gain);

/// A seamlessly repeating square of fractal noise, 32-bit float, about -1 to 1; `size_px` a power of two.
cv::Mat noise_tile(std::uint64_t seed, int size_px, double gain);

/// A smooth random function over an image with variance 1: cubic B-splines over a grid of nearly normal numbers.
class SmoothField {
 public:
  SmoothField(std::uint64_t seed, double grid_px, cv::Size image);
  /// Beyond the image the value at its border.
  [[nodiscard]] double at(double x_px, double y_px) const;

 private:
  double grid_px_;
  cv::Mat nodes_;  // CV_64F, one more on every side than the image needs
};

}  // namespace imprint
