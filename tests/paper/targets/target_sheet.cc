#include "tests/paper/targets/target_sheet.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <opencv2/imgproc.hpp>

namespace imprint::paper {
namespace {

constexpr int columns = 10;
constexpr int pitch_px = 130;
constexpr double two_pi = 2.0 * std::numbers::pi;

/// Paint and paper of the real scene in place of ideal black and white.
constexpr double scene_black = 0.16;
constexpr double scene_white = 0.72;

Sheet blank_sheet(std::size_t targets) {
  const int rows = (static_cast<int>(targets) + columns - 1) / columns;
  return {cv::Mat(rows * pitch_px, columns * pitch_px, CV_32F, cv::Scalar(1.0)), {}};
}

/// The centre is put between pixels at random, so that no target enjoys a pixel grid of its own.
cv::Point2d place_of(std::size_t index, std::mt19937_64& random) {
  std::uniform_real_distribution<double> phase(-0.5, 0.5);
  const auto row = static_cast<double>(index / columns);
  const auto column = static_cast<double>(index % columns);
  const double x = (column + 0.5) * pitch_px + phase(random);
  return {x, (row + 0.5) * pitch_px + phase(random)};
}

bool ring_is_white(const TargetLibrary& library, std::uint32_t code, double turn, double x, double y) {
  const double radius = std::hypot(x, y) / dot_radius_px * library.geometry.dot_radius;
  if (radius <= library.geometry.dot_radius) return true;
  if (radius < library.geometry.ring_inner_radius || radius > library.geometry.ring_outer_radius) return false;
  double share = (std::atan2(y, x) - turn) / two_pi;
  share -= std::floor(share);
  const int bit = std::min(library.bits - 1, static_cast<int>(share * library.bits));
  return ((code >> (library.bits - 1 - bit)) & 1U) != 0;
}

/// Sets each pixel of the square to the mean of `samples` x `samples` values of `value(x, y)`, x and y from the centre.
template <class Value>
void fill_square(cv::Mat& image, const cv::Point2d& center, double half_px, int samples, const Value& value) {
  const int left = static_cast<int>(std::lround(center.x - half_px));
  const int top = static_cast<int>(std::lround(center.y - half_px));
  const int side = static_cast<int>(std::lround(2.0 * half_px));
  for (int y = top; y < top + side; ++y) {
    for (int x = left; x < left + side; ++x) {
      double sum = 0.0;
      for (int j = 0; j < samples; ++j) {
        for (int i = 0; i < samples; ++i) {
          sum += value(x + (i + 0.5) / samples - 0.5 - center.x, y + (j + 0.5) / samples - 0.5 - center.y);
        }
      }
      image.at<float>(y, x) = static_cast<float>(sum / (samples * samples));
    }
  }
}

/// Puts the squares of a plain sheet into a cluttered scene: paint and paper for black and white, uneven light over
/// both, a lens, a little noise.
void move_into_scene(Sheet& sheet) {
  cv::Mat scene = draw_clutter(sheet.image.cols, sheet.image.rows, 77);
  for (const auto& [id, center] : sheet.centers) {
    const cv::Rect square(static_cast<int>(std::lround(center.x - 0.5 * target_side_px)),
                          static_cast<int>(std::lround(center.y - 0.5 * target_side_px)), target_side_px,
                          target_side_px);
    const cv::Mat painted = sheet.image(square) * (scene_white - scene_black) + scene_black;
    painted.copyTo(scene(square));
  }
  for (int y = 0; y < scene.rows; ++y) {
    for (int x = 0; x < scene.cols; ++x) {
      const double light = 1.0 + 0.25 * std::sin(x / 170.0 + 0.4) * std::cos(y / 210.0);
      scene.at<float>(y, x) *= static_cast<float>(light);
    }
  }
  cv::GaussianBlur(scene, scene, {}, 0.7);
  cv::RNG noise(5);
  cv::Mat grain(scene.size(), CV_32F);
  noise.fill(grain, cv::RNG::NORMAL, 0.0, 0.008);
  sheet.image = scene + grain;
}

/// Noise of equal power in each octave, mean 0, about 1 in size.
cv::Mat octaves(int width, int height, cv::RNG& random) {
  cv::Mat sum = cv::Mat::zeros(height, width, CV_32F);
  for (int cell = 4; cell < std::min(width, height); cell *= 2) {
    cv::Mat coarse(height / cell + 2, width / cell + 2, CV_32F);
    random.fill(coarse, cv::RNG::NORMAL, 0.0, 1.0);
    cv::Mat fine;
    cv::resize(coarse, fine, {width, height}, 0.0, 0.0, cv::INTER_CUBIC);
    sum += fine;
  }
  return sum * 0.4;
}

}  // namespace

Sheet draw_rings(const TargetLibrary& library, Background background) {
  Sheet sheet = blank_sheet(library.codes.size());
  std::mt19937_64 random(library.codes.size());
  std::uniform_real_distribution<double> turn(0.0, two_pi);
  for (std::size_t i = 0; i < library.codes.size(); ++i) {
    const cv::Point2d center = place_of(i, random);
    const double begin = turn(random);
    const std::uint32_t code = library.codes[i].code;
    fill_square(sheet.image, center, 0.5 * target_side_px, 8,
                [&](double x, double y) { return ring_is_white(library, code, begin, x, y) ? 1.0 : 0.0; });
    sheet.centers[library.codes[i].id] = center;
  }
  if (background == Background::cluttered) move_into_scene(sheet);
  return sheet;
}

Sheet draw_aruco(const cv::aruco::Dictionary& dictionary, Background background) {
  const auto count = static_cast<std::size_t>(dictionary.bytesList.rows);
  Sheet sheet = blank_sheet(count);
  std::mt19937_64 random(count);
  const int modules = dictionary.markerSize + 2;
  const double module_px = static_cast<double>(target_side_px) / (modules + 2);
  for (std::size_t i = 0; i < count; ++i) {
    const cv::Point2d center = place_of(i, random);
    cv::Mat pattern;
    dictionary.drawMarker(static_cast<int>(i), modules, pattern);
    fill_square(sheet.image, center, 0.5 * target_side_px, 8, [&](double x, double y) {
      const int column = static_cast<int>(std::floor(x / module_px + 0.5 * modules));
      const int row = static_cast<int>(std::floor(y / module_px + 0.5 * modules));
      const bool inside = column >= 0 && row >= 0 && column < modules && row < modules;
      return !inside || pattern.at<std::uint8_t>(row, column) != 0 ? 1.0 : 0.0;
    });
    sheet.centers[static_cast<int>(i)] = center;
  }
  if (background == Background::cluttered) move_into_scene(sheet);
  return sheet;
}

Sheet with_patches(const Sheet& sheet, const Patch& patch, int bits) {
  Sheet covered{sheet.image.clone(), sheet.centers};
  if (patch.bits <= 0.0) return covered;
  std::mt19937_64 random(patch.seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const double extent = two_pi * patch.bits / bits;
  for (const auto& [id, center] : sheet.centers) {
    const double first = two_pi * uniform(random);
    const double grey = uniform(random);
    const double reach = 3.5 * dot_radius_px;
    const auto share = [&](double x, double y) {
      const double radius = std::hypot(x, y);
      double angle = (std::atan2(y, x) - first) / two_pi;
      angle = (angle - std::floor(angle)) * two_pi;
      return radius > 1.5 * dot_radius_px && radius < reach && angle < extent ? 1.0 : 0.0;
    };
    cv::Mat cover = cv::Mat::zeros(sheet.image.size(), CV_32F);
    const int half = static_cast<int>(reach) + 3;
    const cv::Rect square(static_cast<int>(center.x) - half, static_cast<int>(center.y) - half, 2 * half, 2 * half);
    cv::Mat part = cv::Mat::zeros(square.size(), CV_32F);
    fill_square(part, {center.x - square.x, center.y - square.y}, reach + 1.0, 4, share);
    cv::Mat below = covered.image(square);
    below = below.mul(1.0 - part) + grey * part;
  }
  return covered;
}

cv::Mat draw_clutter(int width, int height, std::uint64_t seed, LookAlikes look_alikes) {
  cv::RNG random(seed);
  cv::Mat scene = octaves(width, height, random) * 0.13 + 0.5;
  const double area = static_cast<double>(width) * height;
  const int things = static_cast<int>(area / 4000.0);
  for (int i = 0; i < things; ++i) {
    const cv::Point place(random.uniform(0, width), random.uniform(0, height));
    const cv::Scalar grey(random.uniform(0.0, 1.0));
    const double size = std::exp(random.uniform(std::log(2.0), std::log(60.0)));
    const cv::Size2d axes(size, size * random.uniform(0.3, 1.0));
    const double turn = random.uniform(0.0, 180.0);
    const int line = random.uniform(0, 3) == 0 ? -1 : 1 + static_cast<int>(size / random.uniform(3.0, 12.0));
    switch (random.uniform(0, look_alikes == LookAlikes::with ? 6 : 5)) {
      case 0:
        cv::ellipse(scene, cv::RotatedRect(place, axes * 2.0, static_cast<float>(turn)), grey, line);
        break;
      case 1:
        cv::rectangle(scene, cv::Rect(place, cv::Size(axes * 2.0)), grey, line);
        break;
      case 2: {
        const double along = 4.0 * size;
        const cv::Point step(static_cast<int>(along * std::cos(turn)), static_cast<int>(along * std::sin(turn)));
        cv::line(scene, place, place + step, grey, 1 + static_cast<int>(size / 10.0));
        break;
      }
      case 3:
        cv::putText(scene, std::string(1, static_cast<char>(random.uniform(48, 91))), place, cv::FONT_HERSHEY_SIMPLEX,
                    size / 12.0, grey, 1 + static_cast<int>(size / 12.0), cv::LINE_AA);
        break;
      case 4:  // bright spots on dark ground, like rivets: what a dot is mistaken for
        cv::circle(scene, place, static_cast<int>(2.2 * size), cv::Scalar(0.1), -1, cv::LINE_AA);
        cv::circle(scene, place, static_cast<int>(0.8 * size), grey, -1, cv::LINE_AA);
        break;
      default: {  // arcs about a spot: rings that carry no code
        cv::circle(scene, place, static_cast<int>(1.6 * size), cv::Scalar(0.15), -1, cv::LINE_AA);
        cv::circle(scene, place, static_cast<int>(0.5 * size), grey, -1, cv::LINE_AA);
        for (int arc = random.uniform(1, 6); arc > 0; --arc) {
          const double first = random.uniform(0.0, 360.0);
          cv::ellipse(scene, place, cv::Size(cv::Size2d(1.25 * size, 1.25 * size)), 0.0, first,
                      first + random.uniform(10.0, 120.0), grey, std::max(1, static_cast<int>(0.5 * size)),
                      cv::LINE_AA);
        }
      }
    }
  }
  cv::GaussianBlur(scene, scene, {}, 0.7);
  return scene;
}

}  // namespace imprint::paper
