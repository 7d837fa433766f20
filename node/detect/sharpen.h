#pragma once

#include <optional>

#include <opencv2/core.hpp>

namespace imprint {

/// Standard deviation, in px, of the blur of the sharpest edges of an image, pixel width included, from how the
/// steepest slopes compare with the strongest curvatures along rows and columns (for an edge blurred by s their ratio
/// is 1.65 s). Zero where `noise` hides it.
double edge_blur_px(const cv::Mat& image, double noise);

/// An image with a blur taken out.
struct SharpenedImage {
  cv::Mat image;            ///< 32-bit float
  double noise_gain = 1.0;  ///< of white noise, ratio of standard deviations
};

/// Wiener filter against a Gaussian blur of `blur_px`, as strong as keeps noise of standard deviation `noise` below
/// `allowed_noise`; nothing when even the weakest does not.
std::optional<SharpenedImage> sharpen(const cv::Mat& image, double blur_px, double noise, double allowed_noise);

}  // namespace imprint
