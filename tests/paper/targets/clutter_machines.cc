// Round parts of machines, each seen under some tilt: wheels, screws, flanges, dials.
#include <cmath>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "tests/paper/targets/clutter_frames.h"

namespace imprint::paper {
namespace {

cv::Scalar grey(double level) { return cv::Scalar::all(level); }

/// A plane seen under a tilt: draws circles, sectors and polygons given in its polar coordinates, 16 steps a pixel.
class TiltedFace {
 public:
  TiltedFace(cv::Mat& canvas, cv::RNG& random, double radius)
      : canvas_(canvas),
        center_(random.uniform(0.0, 1.0) * canvas.cols, random.uniform(0.0, 1.0) * canvas.rows),
        radius_(radius),
        axis_(random.uniform(0.0, CV_PI)),
        squeeze_(random.uniform(0.35, 1.0)) {}

  /// Where (radius in units of the face's, angle) lies, in px.
  [[nodiscard]] cv::Point2d at(double radius, double angle) const {
    const double x = radius_ * radius * std::cos(angle);
    const double y = radius_ * radius * std::sin(angle) * squeeze_;
    return {center_.x + x * std::cos(axis_) - y * std::sin(axis_),
            center_.y + x * std::sin(axis_) + y * std::cos(axis_)};
  }

  void polygon(const std::vector<cv::Point2d>& outline, double level) {
    std::vector<cv::Point> steps;
    for (const cv::Point2d& p : outline) steps.emplace_back(cvRound(p.x * 16.0), cvRound(p.y * 16.0));
    cv::fillPoly(canvas_, std::vector{steps}, grey(level), cv::LINE_AA, 4);
  }

  void disc(double radius, double level) { sector(0.0, radius, 0.0, 2.0 * CV_PI, level); }

  void sector(double inner, double outer, double from, double to, double level) {
    const int points = 6 + static_cast<int>(std::abs(to - from) * 14.0);
    std::vector<cv::Point2d> outline;
    for (int i = 0; i <= points; ++i) outline.push_back(at(outer, from + (to - from) * i / points));
    if (inner > 0.0) {
      for (int i = points; i >= 0; --i) outline.push_back(at(inner, from + (to - from) * i / points));
    }
    polygon(outline, level);
  }

  /// Discs of radius `size` about a circle: bolts of a flange, balls of a bearing.
  void circle_of_discs(int count, double at_radius, double size, double level, double turn) {
    for (int i = 0; i < count; ++i) {
      const cv::Point2d middle = at(at_radius, turn + 2.0 * CV_PI * i / count);
      std::vector<cv::Point2d> outline;
      for (int k = 0; k < 20; ++k) outline.push_back(middle + at(size, k * CV_PI / 10.0) - center_);
      polygon(outline, level);
    }
  }

  [[nodiscard]] const cv::Point2d& center() const { return center_; }

 private:
  cv::Mat& canvas_;
  cv::Point2d center_;
  double radius_;
  double axis_;
  double squeeze_;
};

void draw_gear(TiltedFace& face, cv::RNG& random) {
  const double metal = random.uniform(0.3, 1.0);
  const int teeth = random.uniform(6, 40);
  const double root = random.uniform(0.75, 0.93);
  std::vector<cv::Point2d> outline;
  for (int i = 0; i < 4 * teeth; ++i) outline.push_back(face.at(i % 4 < 2 ? 1.0 : root, CV_PI * i / (2.0 * teeth)));
  face.polygon(outline, metal);
  const double rim = random.uniform(0.4, 0.7);
  if (random.uniform(0, 2) == 0) {
    const int spokes = random.uniform(3, 9);
    const double open = random.uniform(0.4, 0.85) * 2.0 * CV_PI / spokes;
    for (int i = 0; i < spokes; ++i) {
      const double from = 2.0 * CV_PI * i / spokes;
      face.sector(0.3, rim, from, from + open, random.uniform(0.0, 0.3));
    }
  }
  face.disc(random.uniform(0.08, 0.25), random.uniform(0.0, 1.0));
}

/// A screw with its washer: hexagon, slot, cross or socket.
void draw_screw(TiltedFace& face, cv::RNG& random) {
  face.disc(1.0, random.uniform(0.2, 0.9));
  const double shadow = random.uniform(0.6, 0.9);
  face.disc(shadow, random.uniform(0.0, 0.3));
  const double head = random.uniform(0.45, 0.95) * shadow;
  const double metal = random.uniform(0.4, 1.0);
  const double turn = random.uniform(0.0, CV_PI);
  const auto hexagon = [&](double size, double level) {
    std::vector<cv::Point2d> corners;
    for (int i = 0; i < 6; ++i) corners.push_back(face.at(size, turn + i * CV_PI / 3.0));
    face.polygon(corners, level);
  };
  switch (random.uniform(0, 4)) {
    case 0:
      hexagon(head, metal);
      break;
    case 1:
      face.disc(head, metal);
      hexagon(0.5 * head, 0.05);
      break;
    case 2:
      face.disc(head, metal);
      face.polygon({face.at(head, turn - 0.12), face.at(head, turn + 0.12), face.at(head, turn + CV_PI - 0.12),
                    face.at(head, turn + CV_PI + 0.12)},
                   0.1);
      break;
    default:
      hexagon(head, metal);
      face.disc(0.6 * head, 0.1);
      face.disc(0.5 * head, random.uniform(0.3, 0.9));
  }
}

/// A hub within a circle of bolts, holes or balls.
void draw_flange(TiltedFace& face, cv::RNG& random) {
  const double plate = random.uniform(0.0, 1.0);
  const double other = plate < 0.5 ? random.uniform(0.5, 1.0) : random.uniform(0.0, 0.5);
  face.disc(1.0, plate);
  const double circle = random.uniform(0.45, 0.88);
  const double size = random.uniform(0.04, 0.16);
  face.circle_of_discs(random.uniform(3, 25), circle, size, other, random.uniform(0.0, CV_PI));
  const double hub = random.uniform(0.15, std::max(0.16, circle - size - 0.05));
  if (random.uniform(0, 2) == 0) face.disc(std::min(hub * 1.2, circle - size), 0.5 * (plate + other));
  face.disc(hub, other);
  if (random.uniform(0, 2) == 0) face.disc(hub * random.uniform(0.2, 0.8), plate);
}

/// Concentric rings, some of them broken: plates, targets for shooting, pulleys, lamps.
void draw_rings_of_any_width(TiltedFace& face, cv::RNG& random) {
  double radius = 1.0;
  for (int ring = random.uniform(2, 8); ring > 0; --ring) {
    face.disc(radius, random.uniform(0.0, 1.0));
    if (random.uniform(0, 3) == 0) {
      const double from = random.uniform(0.0, 2.0 * CV_PI);
      face.sector(radius * random.uniform(0.5, 0.9), radius, from, from + random.uniform(0.3, 4.0),
                  random.uniform(0.0, 1.0));
    }
    radius *= random.uniform(0.45, 0.92);
  }
}

/// A dial: figures and strokes about a hub, a hand over them.
void draw_dial(cv::Mat& canvas, TiltedFace& face, double radius, cv::RNG& random) {
  const double ground = random.uniform(0, 2) == 0 ? random.uniform(0.0, 0.2) : random.uniform(0.8, 1.0);
  const double ink = 1.0 - ground;
  face.disc(1.1, random.uniform(0.0, 1.0));
  face.disc(1.0, ground);
  const int strokes = random.uniform(2, 11) * 5;
  const double from = random.uniform(0.0, 2.0 * CV_PI);
  const double extent = random.uniform(3.0, 2.0 * CV_PI);
  const double inner = random.uniform(0.55, 0.85);
  const double width = random.uniform(0.05, 0.6) * extent / strokes;
  for (int i = 0; i <= strokes; ++i) {
    const double angle = from + extent * i / strokes;
    const bool long_stroke = i % 5 == 0;
    face.sector(long_stroke ? inner - 0.08 : inner, 0.93, angle, angle + (long_stroke ? 1.5 : 1.0) * width, ink);
    if (long_stroke && random.uniform(0, 2) == 0) {
      cv::putText(canvas, std::to_string(i), face.at(inner - 0.2, angle), cv::FONT_HERSHEY_DUPLEX, radius / 160.0,
                  grey(ink), 1 + static_cast<int>(radius / 80.0), cv::LINE_AA);
    }
  }
  const double hand = from + extent * random.uniform(0.0, 1.0);
  const double half = random.uniform(0.05, 0.15);
  face.polygon({face.at(half, hand + CV_PI / 2.0), face.at(0.85, hand), face.at(half, hand - CV_PI / 2.0)},
               random.uniform(0.2, 0.8));
  face.disc(random.uniform(0.08, 0.35), random.uniform(0, 2) == 0 ? ink : random.uniform(0.0, 1.0));
}

/// Boards and shadows behind the parts.
cv::Mat draw_bench(int width, int height, cv::RNG& random) {
  cv::Mat canvas(height, width, CV_32F, grey(random.uniform(0.05, 0.7)));
  for (int i = 0; i < 30; ++i) {
    const cv::RotatedRect board(cv::Point2f(random.uniform(0.0F, 1.0F) * width, random.uniform(0.0F, 1.0F) * height),
                                cv::Size2f(random.uniform(100.0F, 1200.0F), random.uniform(30.0F, 500.0F)),
                                random.uniform(0.0F, 180.0F));
    cv::Point2f corners[4];
    board.points(corners);
    const std::vector<cv::Point> outline(corners, corners + 4);
    cv::fillConvexPoly(canvas, outline, grey(random.uniform(0.0, 0.9)), cv::LINE_AA);
  }
  return canvas;
}

double random_radius(cv::RNG& random) { return std::exp(random.uniform(std::log(6.0), std::log(160.0))); }

}  // namespace

cv::Mat draw_machines(int width, int height, cv::RNG& random) {
  cv::Mat canvas = draw_bench(width, height, random);
  for (int i = width * height / 8000; i > 0; --i) {
    TiltedFace face(canvas, random, random_radius(random));
    switch (random.uniform(0, 4)) {
      case 0:
        draw_gear(face, random);
        break;
      case 1:
        draw_screw(face, random);
        break;
      case 2:
        draw_flange(face, random);
        break;
      default:
        draw_rings_of_any_width(face, random);
    }
  }
  return canvas;
}

cv::Mat draw_gauges(int width, int height, cv::RNG& random) {
  cv::Mat canvas = draw_bench(width, height, random);
  for (int i = width * height / 16000; i > 0; --i) {
    const double radius = random_radius(random);
    TiltedFace face(canvas, random, radius);
    draw_dial(canvas, face, radius, random);
  }
  return canvas;
}

}  // namespace imprint::paper
