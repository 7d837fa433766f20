#include "node/detect/looks.h"

#include <algorithm>

#include "node/detect/sharpen.h"
#include "node/detect/star_ellipse.h"

namespace imprint {
namespace {

/// The finest level that the smallest dot, seen at 72 degrees, needs.
int first_level(const ImagePyramid& pyramid, double min_dot_px) {
  constexpr double foreshortening = 0.3;
  int l = 0;
  while (l + 1 < pyramid.levels() &&
         2.0 * min_level_semi_minor_px * ImagePyramid::scale(l + 1) <= foreshortening * min_dot_px)
    ++l;
  return l;
}

/// Where even the sharpest edges are blurred over a px of the level, dots some px wide are lost in their rings: looks
/// with some of that blur taken out.
void add_sharpened_looks(const GreyImage& image, int l, double image_noise, std::vector<Look>& looks) {
  constexpr double rounding = 0.3;        // of grey values, as a standard deviation
  constexpr double allowed_noise = 0.04;  // share of the grey values' range
  const double noise = std::max(rounding, image_noise) / ImagePyramid::scale(l);
  const cv::Mat& level = image.mat();
  // Sharp images have 0.3 here; the estimate grows more slowly than the blur where there are no long edges.
  constexpr double blurred_px = 0.6;
  if (edge_blur_px(level, noise) < blurred_px) return;
  double lowest = 0.0;
  double highest = 0.0;
  cv::minMaxLoc(level, &lowest, &highest);
  for (const double removed : {1.0, 1.5, 1.9}) {
    if (const auto sharp = sharpen(level, removed, noise, allowed_noise * (highest - lowest))) {
      looks.push_back(
          {GreyImage(sharp->image), l, sharp->noise_gain * noise, removed * ImagePyramid::scale(l), BlobSize::small});
    }
  }
}

}  // namespace

int levels_for(double max_dot_px) {
  int levels = 1;
  while (2.0 * max_level_semi_minor_px * ImagePyramid::scale(levels - 1) < max_dot_px) ++levels;
  return levels;
}

std::vector<Look> choose_looks(const ImagePyramid& pyramid, double noise, const DetectConfig& config) {
  const int first = first_level(pyramid, config.min_dot_px);
  std::vector<Look> looks;
  constexpr double tiny_px = 4.0;
  if (first == 0 && config.min_dot_px < tiny_px) {
    looks.push_back({GreyImage(pyramid.level(0).mat(), GreyImage::Size::doubled), -1, noise, 0.0, BlobSize::tiny});
  }
  for (int l = first; l < pyramid.levels(); ++l) {
    looks.push_back({pyramid.level(l), l, noise / ImagePyramid::scale(l)});
    if (l > 0) add_sharpened_looks(pyramid.level(l), l, noise, looks);
  }
  return looks;
}

}  // namespace imprint
