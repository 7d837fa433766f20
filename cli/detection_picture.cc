#include "cli/detection_picture.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "cli/brightened.h"

namespace imprint {
namespace {

constexpr int font = cv::FONT_HERSHEY_SIMPLEX;
const cv::Scalar black{0, 0, 0};
const cv::Scalar target_color{60, 255, 60};  // blue, green, red

cv::Scalar color_of(Rejection reason) {
  switch (reason) {
    case Rejection::none:
      return target_color;
    case Rejection::no_dark_ground:
      return {170, 170, 170};
    case Rejection::no_ring:
      return {255, 170, 60};
    case Rejection::poor_ellipse:
      return {230, 90, 230};
    case Rejection::size:
      return {230, 230, 60};
    case Rejection::outside:
      return {90, 160, 200};
    case Rejection::no_code:
      return {70, 70, 255};
    case Rejection::id_twice:
      return {40, 200, 255};
  }
  return {255, 255, 255};
}

class Picture {
 public:
  explicit Picture(const cv::Mat& image)
      : zoom_(std::clamp(static_cast<int>(1200.0 / std::max(image.cols, image.rows)), 1, 8)),
        pen_(std::max(1, static_cast<int>(std::lround(std::max(image.cols, image.rows) * zoom_ / 2500.0)))) {
    cv::resize(brightened(image), canvas_, {}, zoom_, zoom_, cv::INTER_NEAREST);
  }

  /// An ellipse about the same centre, `radii` times as large, at least 4 px.
  void ellipse(const Ellipse& shape, double radii, const cv::Scalar& color) {
    constexpr int points = 64;
    constexpr int fraction_bits = 4;
    const double least = 4.0 / (zoom_ * std::max(axes_of(shape).semi_major_px, 1e-3));
    const Eigen::Matrix2d frame = std::max(radii, least) * frame_of(shape);
    std::vector<cv::Point> outline;
    for (int i = 0; i < points; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / points;
      const cv::Point2d p = place(shape.center + frame * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
      outline.emplace_back(cvRound(p.x * (1 << fraction_bits)), cvRound(p.y * (1 << fraction_bits)));
    }
    cv::polylines(canvas_, outline, true, color, pen_, cv::LINE_AA, fraction_bits);
  }

  void cross(const Eigen::Vector2d& at, const cv::Scalar& color) {
    cv::drawMarker(canvas_, place(at), color, cv::MARKER_CROSS, 6 * pen_ + 1, pen_, cv::LINE_AA);
  }

  /// Words right of a place, with a dark rim that makes them legible on any ground.
  void label(const std::string& words, const Eigen::Vector2d& at, double size, const cv::Scalar& color) {
    const double scale = size * pen_;
    const cv::Size extent = cv::getTextSize(words, font, scale, pen_, nullptr);
    cv::Point2d corner = place(at);
    corner.x = std::min(corner.x, canvas_.cols - extent.width - 2.0);
    corner.y = std::max(std::min(corner.y + 0.5 * extent.height, canvas_.rows - 3.0), extent.height + 2.0);
    cv::putText(canvas_, words, corner, font, scale, black, 3 * pen_ + 1, cv::LINE_AA);
    cv::putText(canvas_, words, corner, font, scale, color, pen_, cv::LINE_AA);
  }

  /// Lines of words on a dark strip added below, as many beside each other as the width has room for.
  void add_legend(const std::vector<std::pair<std::string, cv::Scalar>>& lines) {
    const double scale = 0.55 * pen_;
    const int row = 22 * pen_;
    int column = 0;
    for (const auto& [words, color] : lines)
      column = std::max(column, cv::getTextSize(words, font, scale, pen_, nullptr).width + 40 * pen_);
    const int columns = std::max(1, canvas_.cols / column);
    const int rows = (static_cast<int>(lines.size()) + columns - 1) / columns;
    const int below = canvas_.rows;
    cv::copyMakeBorder(canvas_, canvas_, 0, rows * row + 10 * pen_, 0, std::max(0, column - canvas_.cols),
                       cv::BORDER_CONSTANT, cv::Scalar(24, 24, 24));
    for (int i = 0; i < static_cast<int>(lines.size()); ++i) {
      const auto& [words, color] = lines[static_cast<std::size_t>(i)];
      const cv::Point corner((i % columns) * column, below + (i / columns + 1) * row);
      cv::circle(canvas_, corner + cv::Point(16 * pen_, -5 * pen_), 6 * pen_, color, 2 * pen_, cv::LINE_AA);
      cv::putText(canvas_, words, corner + cv::Point(30 * pen_, 0), font, scale, color, pen_, cv::LINE_AA);
    }
  }

  [[nodiscard]] const cv::Mat& canvas() const { return canvas_; }

 private:
  [[nodiscard]] cv::Point2d place(const Eigen::Vector2d& p) const {
    return {(p.x() + 0.5) * zoom_ - 0.5, (p.y() + 0.5) * zoom_ - 0.5};
  }

  int zoom_;
  int pen_;
  cv::Mat canvas_;
};

/// Right of the ellipse's `radii`-fold.
Eigen::Vector2d beside(const Ellipse& ellipse, double radii) {
  const Eigen::Matrix2d frame = frame_of(ellipse);
  return ellipse.center + Eigen::Vector2d(radii * frame.row(0).norm() + 2.0, 0.0);
}

}  // namespace

cv::Mat draw_detection_picture(const cv::Mat& image, const std::vector<DetectedTarget>& targets,
                               const DetectionTrace& trace) {
  Picture picture(image);
  std::map<Rejection, int> counts;
  for (const auto& rejected : trace.rejected) {
    ++counts[rejected.reason];
    picture.ellipse(rejected.ellipse, 1.0, color_of(rejected.reason));
  }
  for (const auto& decoded : trace.decoded) {
    if (decoded.ring.accepted) continue;
    picture.label(fmt::format("{}?{:g}", decoded.ring.id, decoded.ring.distance), beside(decoded.dot.ellipse, 1.0),
                  0.35, color_of(Rejection::no_code));
  }
  constexpr double ring_radii = 3.2;
  for (const DetectedTarget& target : targets) {
    const Eigen::Vector2d center(target.center.x_px, target.center.y_px);
    const auto decoded = std::find_if(trace.decoded.begin(), trace.decoded.end(), [&](const auto& d) {
      return d.ring.accepted && d.ring.id == target.id && (d.dot.ellipse.center - center).norm() < 2.0;
    });
    Eigen::Vector2d at = center + Eigen::Vector2d(0.6 * ring_radii * target.dot_diameter_px, 0.0);
    if (decoded != trace.decoded.end()) {
      picture.ellipse(decoded->dot.ellipse, 1.0, target_color);
      picture.ellipse(decoded->dot.ellipse, ring_radii, target_color);
      at = beside(decoded->dot.ellipse, ring_radii);
    }
    picture.cross(center, target_color);
    picture.label(std::to_string(target.id), at, 0.55, target_color);
  }
  std::vector<std::pair<std::string, cv::Scalar>> legend{
      {fmt::format("{}: {}", name_of(Rejection::none), targets.size()), target_color}};
  for (const auto& [reason, count] : counts)
    legend.emplace_back(fmt::format("{}: {}", name_of(reason), count), color_of(reason));
  if (counts.contains(Rejection::no_code))
    legend.emplace_back("7?1.5: nearest id 7 is 1.5 bits away", color_of(Rejection::no_code));
  picture.add_legend(legend);
  return picture.canvas();
}

}  // namespace imprint
