#include "simulation/backdrop.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "simulation/random.h"
#include "simulation/texture.h"

namespace imprint {
namespace {

constexpr int tile_px = 1024;

class BackdropPainter {
 public:
  BackdropPainter(const Scene& scene, int camera)
      : size_(scene.cameras[static_cast<std::size_t>(camera)].model.width_px,
              scene.cameras[static_cast<std::size_t>(camera)].model.height_px),
        unit_(size_.width / 4656.0),
        level_(scene.backdrop.level),
        clutter_(scene.backdrop.clutter),
        random_(stream_seed(scene.seed, "backdrop", static_cast<std::uint64_t>(camera))),
        smooth_(noise_tile(random_.bits(), tile_px, 0.5)),
        rough_(noise_tile(random_.bits(), tile_px, 0.85)),
        image_(size_, CV_32F, cv::Scalar(level_)) {}

  void hall() {
    if (clutter_ <= 0.0) return;
    base(0.45, 0.35);
    repeat(12, [&] { panel(random_.uniform(300, 1400), random_.uniform(200, 1000), random_.uniform(0.3, 1.6), 0.35); });
    repeat(46, [&] { panel(random_.uniform(40, 420), random_.uniform(30, 320), random_.uniform(0.2, 3.0), 0.5); });
    repeat(16, [&] { beam(random_.uniform(-1.5, 1.5), random_.uniform(10, 110), random_.uniform(0.3, 2.6)); });
    repeat(13, [&] { beam(random_.uniform(-0.09, 0.09), random_.uniform(4, 90), random_.uniform(0.8, 4.0)); });
    repeat(8, [&] { grating(); });
    repeat(60, [&] { round(random_.uniform(3, 22), random_.uniform(0.2, 5.0)); });
    repeat(5, [&] { lamp(); });
    cv::max(image_, 0.002, image_);
  }

  void wall() {
    if (clutter_ <= 0.0) return;
    const double slope_x = random_.uniform(-0.12, 0.12), slope_y = random_.uniform(-0.12, 0.12);
    for (int y = 0; y < size_.height; ++y) {
      float* row = image_.ptr<float>(y);
      const double v = static_cast<double>(y) / size_.height - 0.5;
      for (int x = 0; x < size_.width; ++x) {
        const double u = static_cast<double>(x) / size_.width - 0.5;
        row[x] = static_cast<float>(level_ * (1.0 + slope_x * u + slope_y * v - 0.15 * (u * u + v * v)));
      }
    }
    base_texture(0.012, 4.0);
    repeat(6, [&] {  // stands and cables at the rim of the picture
      const bool left = random_.uniform() < 0.5;
      const cv::Point2f at(
          static_cast<float>(size_.width * (left ? random_.uniform(0.0, 0.07) : random_.uniform(0.93, 1.0))),
          static_cast<float>(size_.height * random_.uniform()));
      quadrilateral(at, random_.uniform(60, 260), random_.uniform(200, 900), random_.uniform(-0.2, 0.2),
                    level_ * random_.uniform(0.15, 0.8), 0.06);
    });
  }

  // Windows, lit beams, uprights and gratings that stand out more than the forging; narrower or wider than one, or
  // short. They draw from a stream of their own, so that the rest of the hall stays as it is.
  void strong(std::uint64_t seed, double density, double level) {
    if (density <= 0.0) return;
    random_ = Random(seed);
    level_ = level, clutter_ = density;
    const auto bright = [&] { return random_.uniform(0.75, 1.0); };
    repeat(3, [&] {
      quadrilateral(anywhere(), random_.uniform(800, 3000), random_.uniform(12, 60), random_.normal() * 0.12,
                    level_ * bright(), 0.08);
    });
    repeat(3, [&] {
      quadrilateral(anywhere(), random_.uniform(20, 120), random_.uniform(400, 2500), random_.normal() * 0.1,
                    level_ * bright(), 0.08);
    });
    repeat(5, [&] {
      const double side = random_.uniform(60, 420);
      quadrilateral(anywhere(), side, side * random_.uniform(0.7, 1.4), random_.normal() * 0.3, level_ * bright(), 0.1);
    });
    repeat(2, [&] { grating(); });
    repeat(8, [&] { round(random_.uniform(8, 60), bright()); });
  }

  [[nodiscard]] const cv::Mat& image() const { return image_; }

 private:
  template <class Paint>
  void repeat(double count, Paint paint) {
    const int times = static_cast<int>(std::lround(count * clutter_));
    for (int i = 0; i < times; ++i) paint();
  }

  cv::Point2f anywhere() {
    return {static_cast<float>(random_.uniform(0, size_.width)), static_cast<float>(random_.uniform(0, size_.height))};
  }

  // Uneven light over the whole picture and the texture of the floor.
  void base(double uneven, double grain) {
    cv::Mat light;
    const cv::Rect some(random_.index(tile_px - 9), random_.index(tile_px - 9), 8, 8);
    cv::Mat small(8, 8, CV_32F);
    for (int i = 0; i < 64; ++i)
      small.at<float>(i / 8, i % 8) = static_cast<float>(1.0 + uneven * random_.uniform(-1.0, 1.0));
    cv::resize(small, light, size_, 0, 0, cv::INTER_CUBIC);
    image_ = image_.mul(light);
    base_texture(grain * 0.5, 1.0);
  }

  void base_texture(double strength, double stretch) {
    for (int y = 0; y < size_.height; ++y) {
      float* row = image_.ptr<float>(y);
      const float* grain = rough_.ptr<float>(static_cast<int>(y / (stretch * std::min(1.0, 2.0 * unit_))) % tile_px);
      for (int x = 0; x < size_.width; ++x) row[x] *= 1.0F + static_cast<float>(strength) * grain[x % tile_px];
    }
  }

  void quadrilateral(cv::Point2f center, double width, double height, double angle, double level, double grain) {
    const double c = std::cos(angle), s = std::sin(angle), w = 0.5 * width * unit_, h = 0.5 * height * unit_;
    std::vector<cv::Point2f> corners;
    for (const auto& [a, b] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}) {
      const double x = a * w * random_.uniform(0.93, 1.07), y = b * h * random_.uniform(0.93, 1.07);
      corners.emplace_back(static_cast<float>(center.x + c * x - s * y), static_cast<float>(center.y + s * x + c * y));
    }
    polygon(corners, level, grain);
  }

  // Fills with texture; the border is softened over a pixel or two.
  void polygon(const std::vector<cv::Point2f>& corners, double level, double grain) {
    const cv::Rect box = (cv::boundingRect(corners) + cv::Size(4, 4) - cv::Point(2, 2)) & cv::Rect({0, 0}, size_);
    if (box.empty()) return;
    cv::Mat mask(box.size(), CV_8U, cv::Scalar(0));
    std::vector<cv::Point> fixed;
    for (const cv::Point2f& p : corners) {
      fixed.emplace_back(static_cast<int>(std::lround((p.x - static_cast<float>(box.x)) * 16.0F)),
                         static_cast<int>(std::lround((p.y - static_cast<float>(box.y)) * 16.0F)));
    }
    cv::fillConvexPoly(mask, fixed, cv::Scalar(255), cv::LINE_AA, 4);
    const cv::Mat& tile = random_.uniform() < 0.5 ? smooth_ : rough_;
    const int ox = random_.index(tile_px), oy = random_.index(tile_px);
    const double gx = random_.uniform(-0.3, 0.3) / box.width, gy = random_.uniform(-0.3, 0.3) / box.height;
    for (int y = 0; y < box.height; ++y) {
      float* row = image_.ptr<float>(box.y + y) + box.x;
      const auto* share = mask.ptr<unsigned char>(y);
      const float* texture = tile.ptr<float>((y + oy) % tile_px);
      for (int x = 0; x < box.width; ++x) {
        if (share[x] == 0) continue;
        const double light = level * (1.0 + gx * (x - 0.5 * box.width) + gy * (y - 0.5 * box.height));
        const double value = light * std::max(0.1, 1.0 + grain * static_cast<double>(texture[(x + ox) % tile_px]));
        row[x] += static_cast<float>(share[x] / 255.0 * (value - static_cast<double>(row[x])));
      }
    }
  }

  void panel(double width, double height, double brightness, double grain) {
    const cv::Point2f at = anywhere();
    const double angle = random_.normal() * 0.25;
    quadrilateral(at, width, height, angle, level_ * brightness, grain);
    if (random_.uniform() < 0.5) {  // light on its upper edge
      const cv::Point2f top(at.x + static_cast<float>(std::sin(angle) * 0.5 * height * unit_),
                            at.y - static_cast<float>(std::cos(angle) * 0.5 * height * unit_));
      quadrilateral(top, width, random_.uniform(4, 14), angle, level_ * brightness * random_.uniform(1.3, 2.2), grain);
    }
  }

  void beam(double angle, double width, double brightness) {
    const cv::Point2f at = anywhere();
    const double length = random_.uniform(700, 4200);
    quadrilateral(at, length, width, angle, level_ * brightness, 0.3);
    const double nx = -std::sin(angle), ny = std::cos(angle);
    for (const double side : {-0.42, 0.42}) {  // flanges
      const cv::Point2f edge(at.x + static_cast<float>(nx * side * width * unit_),
                             at.y + static_cast<float>(ny * side * width * unit_));
      quadrilateral(edge, length, 0.16 * width, angle, level_ * brightness * random_.uniform(0.5, 1.8), 0.3);
    }
  }

  void grating() {  // stairs, fences, rows of bolts
    const cv::Point2f at = anywhere();
    const double angle = random_.uniform() < 0.5 ? random_.normal() * 0.05 : 1.57 + random_.normal() * 0.05;
    const double pitch = random_.uniform(14, 50), width = pitch * random_.uniform(0.2, 0.6),
                 length = random_.uniform(100, 700);
    const double brightness = random_.uniform(0.4, 2.4);
    const int bars = 4 + random_.index(14);
    for (int i = 0; i < bars; ++i) {
      const double shift = (i - 0.5 * bars) * pitch * unit_;
      quadrilateral(
          {at.x - static_cast<float>(std::sin(angle) * shift), at.y + static_cast<float>(std::cos(angle) * shift)},
          length, width, angle, level_ * brightness, 0.2);
    }
  }

  void round(double radius, double brightness) {
    const cv::Point2f at = anywhere();
    const double flat = random_.uniform(0.4, 1.0), angle = random_.angle_rad();
    std::vector<cv::Point2f> corners;
    for (int i = 0; i < 40; ++i) {
      const double a = 6.283185307179586 * i / 40, x = radius * unit_ * std::cos(a),
                   y = radius * unit_ * flat * std::sin(a);
      corners.emplace_back(at.x + static_cast<float>(std::cos(angle) * x - std::sin(angle) * y),
                           at.y + static_cast<float>(std::sin(angle) * x + std::cos(angle) * y));
    }
    polygon(corners, level_ * brightness, 0.1);
  }

  void lamp() {
    const cv::Point2f at = anywhere();
    const double radius = random_.uniform(8, 40) * unit_, glow = random_.uniform(4, 8) * radius;
    const double strength = random_.uniform(0.25, 1.1);
    const int reach = static_cast<int>(4.0 * glow);
    const cv::Rect box =
        cv::Rect(static_cast<int>(at.x) - reach, static_cast<int>(at.y) - reach, 2 * reach, 2 * reach) &
        cv::Rect({0, 0}, size_);
    for (int y = box.y; y < box.y + box.height; ++y) {
      float* row = image_.ptr<float>(y);
      for (int x = box.x; x < box.x + box.width; ++x) {
        const double r2 = std::pow(x - static_cast<double>(at.x), 2) + std::pow(y - static_cast<double>(at.y), 2);
        const double core = 1.0 / (1.0 + std::exp((std::sqrt(r2) - radius) / (0.08 * radius + 0.3)));
        row[x] += static_cast<float>(strength * (core + 0.1 * std::exp(-0.5 * r2 / (glow * glow))));
      }
    }
  }

  cv::Size size_;
  double unit_;  // px of this camera a px of the full-size one
  double level_, clutter_;
  Random random_;
  cv::Mat smooth_, rough_;
  cv::Mat image_;
};

}  // namespace

cv::Mat paint_backdrop(const Scene& scene, int camera) {
  BackdropPainter painter(scene, camera);
  if (scene.kind == SceneKind::forge) painter.hall();
  if (scene.kind == SceneKind::laboratory) painter.wall();
  painter.strong(stream_seed(scene.seed, "strong clutter", static_cast<std::uint64_t>(camera)),
                 scene.backdrop.strong_clutter, scene.backdrop.strong_level);
  return painter.image();
}

}  // namespace imprint
