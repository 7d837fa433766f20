#include "node/detect/detection_trace.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <string>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace imprint {
namespace {

struct Style {
  Rejection reason;
  const char* name;
  cv::Scalar color;  // blue, green, red
};

const std::array styles{
    Style{Rejection::none, "target", {60, 230, 60}},
    Style{Rejection::no_dark_ground, "no dark ground round the dot", {120, 120, 120}},
    Style{Rejection::no_ring, "no ring", {230, 160, 40}},
    Style{Rejection::poor_ellipse, "poor ellipse", {200, 60, 200}},
    Style{Rejection::size, "size", {200, 200, 60}},
    Style{Rejection::outside, "ring outside the image", {40, 120, 160}},
    Style{Rejection::no_code, "no code of the library", {40, 40, 240}},
    Style{Rejection::id_twice, "id found twice", {40, 160, 255}},
};

const Style& style_of(Rejection rejection) {
  return *std::find_if(styles.begin(), styles.end(), [rejection](const Style& s) { return s.reason == rejection; });
}

void draw_ellipse(cv::Mat& canvas, const Ellipse& ellipse, double radii, const cv::Scalar& color) {
  constexpr int points = 48;
  constexpr int fraction_bits = 4;
  const Eigen::Matrix2d frame = frame_of(ellipse);
  std::vector<cv::Point> outline;
  for (int i = 0; i < points; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / points;
    const Eigen::Vector2d p = ellipse.center + radii * frame * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    outline.emplace_back(cvRound(p.x() * (1 << fraction_bits)), cvRound(p.y() * (1 << fraction_bits)));
  }
  cv::polylines(canvas, outline, true, color, 1, cv::LINE_AA, fraction_bits);
}

/// 8-bit colour; 16-bit grey is stretched to its own range.
cv::Mat to_color(const cv::Mat& image) {
  cv::Mat grey;
  if (image.depth() == CV_8U) {
    grey = image;
  } else {
    double lowest = 0.0;
    double highest = 0.0;
    cv::minMaxLoc(image, &lowest, &highest);
    const double scale = 255.0 / std::max(1.0, highest - lowest);
    image.convertTo(grey, CV_8U, scale, -lowest * scale);
  }
  cv::Mat color;
  cv::cvtColor(grey, color, cv::COLOR_GRAY2BGR);
  return color;
}

}  // namespace

const char* name_of(Rejection rejection) { return style_of(rejection).name; }

cv::Mat draw_detections(const cv::Mat& image, const std::vector<DetectedTarget>& targets, const DetectionTrace& trace) {
  cv::Mat canvas = to_color(image);
  for (const auto& rejected : trace.rejected)
    draw_ellipse(canvas, rejected.ellipse, 1.0, style_of(rejected.reason).color);
  const cv::Scalar green = style_of(Rejection::none).color;
  for (const DetectedTarget& target : targets) {
    const auto decoded =
        std::find_if(trace.decoded.begin(), trace.decoded.end(),
                     [&](const DetectionTrace::Decoded& d) { return d.ring.accepted && d.ring.id == target.id; });
    if (decoded != trace.decoded.end()) {
      draw_ellipse(canvas, decoded->dot.ellipse, 1.0, green);
      draw_ellipse(canvas, decoded->dot.ellipse, 3.2, green);
    }
    const cv::Point place(cvRound(target.center.x_px + 1.8 * target.dot_diameter_px), cvRound(target.center.y_px));
    cv::putText(canvas, std::to_string(target.id), place, cv::FONT_HERSHEY_SIMPLEX, 0.5, green, 1, cv::LINE_AA);
  }
  int y = 20;
  for (const Style& style : styles) {
    cv::putText(canvas, style.name, {10, y}, cv::FONT_HERSHEY_SIMPLEX, 0.5, style.color, 1, cv::LINE_AA);
    y += 18;
  }
  return canvas;
}

}  // namespace imprint
