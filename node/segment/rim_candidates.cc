#include "node/segment/rim_candidates.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <opencv2/imgproc.hpp>

namespace imprint {
namespace {

// Standard deviation of the gradient where nothing is: even a crowded hall is plain in a fifth of the image, so the
// quantile of the smallest fifth tells it.
double gradient_noise(const cv::Mat_<float>& gy, const cv::Mat_<unsigned char>& inside, double quantum) {
  std::vector<float> sample;
  for (int y = 1; y < gy.rows; y += 3)
    for (int x = (y % 2); x < gy.cols; x += 3)
      if (inside(y, x)) sample.push_back(std::abs(gy(y, x)));
  if (sample.empty()) return quantum;
  constexpr double kFifthOfNormal = 0.2533;  // quantile of the magnitude, in standard deviations
  const auto fifth = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 5);
  std::nth_element(sample.begin(), fifth, sample.end());
  // Without noise the grey steps remain: a quarter of one is what rounding leaves in a smoothed gradient.
  return std::max(*fifth / kFifthOfNormal, 0.25 * quantum);
}

// Weak pixels that hang together with a strong run along the axis.
cv::Mat_<unsigned char> clean_mask(const cv::Mat& weak, const cv::Mat& strong, int run) {
  cv::Mat opened;
  cv::morphologyEx(strong, opened, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_RECT, {run, 1}));
  cv::Mat_<int> label;
  const int count = cv::connectedComponents(weak, label, 8, CV_32S);
  std::vector<unsigned char> keep(static_cast<std::size_t>(count), 0);
  for (int y = 0; y < label.rows; ++y) {
    const unsigned char* on = opened.ptr<unsigned char>(y);
    const int* id = label[y];
    for (int x = 0; x < label.cols; ++x)
      if (on[x] && id[x] > 0) keep[static_cast<std::size_t>(id[x])] = 255;
  }
  cv::Mat_<unsigned char> mask(label.size(), static_cast<unsigned char>(0));
  for (int y = 0; y < label.rows; ++y)
    for (int x = 0; x < label.cols; ++x) mask(y, x) = keep[static_cast<std::size_t>(label(y, x))];
  return mask;
}

// Ridge points of +-gy along each column, the strongest ones. Strength is one half for a gradient of `least` plus a
// third of what the image's strong edges have, at most for twice `least`: clutter may outshine the forging by far.
std::vector<std::vector<RimCandidate>> ridges(const cv::Mat_<float>& gy, float sign,
                                              const cv::Mat_<unsigned char>& mask, double least, int max_count) {
  std::vector<std::vector<RimCandidate>> columns(static_cast<std::size_t>(gy.cols));
  for (int y = 1; y + 1 < gy.rows; ++y) {
    const float *above = gy[y - 1], *here = gy[y], *below = gy[y + 1];
    for (int x = 0; x < gy.cols; ++x) {
      if (!mask(y, x)) continue;
      const float a = sign * above[x], b = sign * here[x], c = sign * below[x];
      if (!(b > a && b >= c)) continue;
      const float bend = a - 2 * b + c;
      const float shift = bend < 0 ? std::clamp(0.5F * (a - c) / bend, -0.5F, 0.5F) : 0.0F;
      columns[static_cast<std::size_t>(x)].push_back({static_cast<float>(y) + shift, b});
    }
  }
  std::vector<float> gradients;
  for (const auto& column : columns)
    for (const RimCandidate& c : column) gradients.push_back(c.strength);
  if (gradients.empty()) return columns;
  const auto strong = gradients.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(gradients.size() - 1));
  std::nth_element(gradients.begin(), strong, gradients.end());
  const float half = static_cast<float>(least) + std::min(*strong / 3, static_cast<float>(least));
  for (auto& column : columns) {
    for (RimCandidate& c : column) c.strength /= c.strength + half;
    if (column.size() <= static_cast<std::size_t>(max_count)) continue;
    std::nth_element(column.begin(), column.begin() + max_count, column.end(),
                     [](const RimCandidate& p, const RimCandidate& q) { return p.strength > q.strength; });
    column.resize(static_cast<std::size_t>(max_count));
    std::sort(column.begin(), column.end(),
              [](const RimCandidate& p, const RimCandidate& q) { return p.y_px < q.y_px; });
  }
  return columns;
}

}  // namespace

RimCandidates find_rim_candidates(const WorkingImage& working, const SegmentConfig& config) {
  cv::Mat_<float> smooth, gx, gy;
  cv::GaussianBlur(working.intensity, smooth, {3, 3}, config.smoothing_sigma_px);
  cv::Sobel(smooth, gx, CV_32F, 1, 0, 3, 1.0 / 8);
  cv::Sobel(smooth, gy, CV_32F, 0, 1, 3, 1.0 / 8);
  smooth.release();
  cv::Mat_<unsigned char> inside;
  cv::erode(working.valid, inside, cv::Mat(), {-1, -1}, 3, cv::BORDER_CONSTANT, cv::Scalar(0));

  RimCandidates found;
  found.gradient_noise = gradient_noise(gy, inside, working.quantum);
  const auto weak_magnitude = static_cast<float>(config.weak_noise_factor * found.gradient_noise);
  const auto strong_magnitude = static_cast<float>(config.strong_noise_factor * found.gradient_noise);
  const auto radian = std::numbers::pi / 180;
  const auto weak_slope = static_cast<float>(std::tan(config.weak_angle_deg * radian));
  const auto strong_slope = static_cast<float>(std::tan(config.strong_angle_deg * radian));

  // 1: weak, 2: strong; below 0 where the image falls. Kept in place of gx, a quarter of its size.
  cv::Mat_<signed char> rim(gy.size(), static_cast<signed char>(0));
  for (int y = 0; y < gy.rows; ++y) {
    for (int x = 0; x < gy.cols; ++x) {
      const float g = std::abs(gy(y, x)), across = std::abs(gx(y, x));
      if (!inside(y, x) || g < weak_magnitude || across > weak_slope * g) continue;
      const signed char level = g >= strong_magnitude && across <= strong_slope * g ? 2 : 1;
      rim(y, x) = gy(y, x) > 0 ? level : static_cast<signed char>(-level);
    }
  }
  gx.release();
  for (const float sign : {1.0F, -1.0F}) {
    const cv::Mat level = sign * rim;
    const cv::Mat_<unsigned char> mask = clean_mask(level > 0, level > 1, config.min_rim_run_px);
    (sign > 0 ? found.upper : found.lower) = ridges(gy, sign, mask, strong_magnitude, config.max_rims_per_column);
  }
  return found;
}

}  // namespace imprint
