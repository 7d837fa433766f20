// Images that nobody means to send: detection ends soon, within bounded memory, and claims nothing.
#include <algorithm>
#include <ctime>
#include <random>

#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "lib/targets/code_distance.h"
#include "node/detect/detect_config.h"
#include "node/detect/detect_targets.h"
#include "tests/unit/node/detect/draw_target.h"

using namespace imprint;
using namespace imprint::test;

namespace {

constexpr int width_px = 4656;  // of the rig's cameras: 16 megapixels
constexpr int height_px = 3520;

/// Twenty codes at distance 3 with 6 transitions or more.
const TargetLibrary& library() {
  static const TargetLibrary codes = [] {
    TargetLibrary made;
    made.min_distance = 3;
    for (std::uint32_t code = 1; made.codes.size() < 20; ++code) {
      const bool far = std::all_of(made.codes.begin(), made.codes.end(), [code](const TargetCode& other) {
        return cyclic_distance(code, other.code, 15) >= 3;
      });
      if (far && bit_transitions(code, 15) >= 6) made.codes.push_back({static_cast<int>(made.codes.size()) + 1, code});
    }
    return made;
  }();
  return codes;
}

struct Cost {
  double seconds = 0.0;  // of the processor, so that a busy machine does not matter
  std::size_t claims = 0;
};

Cost cost_of(const cv::Mat& image) {
  const std::clock_t begin = std::clock();
  const auto found = detect_targets(image, library(), DetectConfig{});
  return {static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, found.size()};
}

/// What a camera of the rig sees on a good day: twenty targets before an even ground with a little noise.
const Cost& clean_frame() {
  static const Cost cost = [] {
    cv::Mat grey(height_px, width_px, CV_8U);
    cv::RNG(3).fill(grey, cv::RNG::NORMAL, 60.0, 2.0);
    for (int i = 0; i < 20; ++i) {
      cv::Mat canvas(120, 120, CV_64F, cv::Scalar(40.0));
      draw(canvas, DrawnTarget::seen(library().codes[static_cast<std::size_t>(i)].code, {60.2, 59.7}, 12.0, 18.0 * i));
      expose(canvas, 0.8, 2.0).copyTo(grey(cv::Rect(300 + 800 * (i % 5), 300 + 800 * (i / 5), 120, 120)));
    }
    return cost_of(grey);
  }();
  return cost;
}

cv::Mat salt_and_pepper(double share, int type) {
  cv::Mat image(height_px, width_px, type, cv::Scalar(type == CV_8U ? 90 : 20000));
  std::mt19937 random(11);
  const auto flipped = static_cast<std::int64_t>(share * width_px * height_px);
  for (std::int64_t i = 0; i < flipped; ++i) {
    const int x = static_cast<int>(random() % width_px);
    const int y = static_cast<int>(random() % height_px);
    const bool white = random() % 2 == 0;
    if (type == CV_8U)
      image.at<std::uint8_t>(y, x) = white ? 255 : 0;
    else
      image.at<std::uint16_t>(y, x) = white ? 65535 : 0;
  }
  return image;
}

cv::Mat tiny_blobs(int count, int radius_px) {
  cv::Mat image(height_px, width_px, CV_8U, cv::Scalar(20));
  std::mt19937 random(5);
  for (int i = 0; i < count; ++i) {
    const cv::Point at(static_cast<int>(random() % width_px), static_cast<int>(random() % height_px));
    cv::circle(image, at, radius_px, cv::Scalar(200), -1);
  }
  return image;
}

/// Dots with dark ground and a broken ring about each: everything that is looked at in vain, looked at to the end.
cv::Mat dots_in_rings(int& dots) {
  cv::Mat image(height_px / 2, width_px / 2, CV_8U, cv::Scalar(30));
  std::mt19937 random(7);
  for (int y = 16; y + 16 < image.rows; y += 30) {
    for (int x = 16; x + 16 < image.cols; x += 30, ++dots) {
      cv::circle(image, {x, y}, 4, cv::Scalar(200), -1, cv::LINE_AA);
      const double from = static_cast<double>(random() % 360);
      cv::ellipse(image, {x, y}, {10, 10}, 0.0, from, from + 30.0, cv::Scalar(200), 4, cv::LINE_AA);
    }
  }
  return image;
}

}  // namespace

TEST_CASE("hostile images: the clean frame that times are compared with shows its twenty targets") {
  CHECK(clean_frame().claims == 20);
}

TEST_CASE("hostile images: images too small for a target are done at once") {
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(20000, 3), cv::Size(3, 20000), cv::Size(2, 2), cv::Size(1, 7)}) {
    for (const int type : {CV_8U, CV_16U}) {
      cv::Mat image(size, type);
      cv::RNG(1).fill(image, cv::RNG::UNIFORM, 0, type == CV_8U ? 256 : 65536);
      const Cost cost = cost_of(image);
      INFO(size.width << " x " << size.height << " px, type " << type << ": " << cost.seconds << " s");
      CHECK(cost.claims == 0);
      CHECK(cost.seconds < clean_frame().seconds);
    }
  }
}

TEST_CASE("hostile images: nothing to see takes no longer than a clean frame") {
  for (const int level : {0, 128, 255}) {
    const Cost cost = cost_of(cv::Mat(height_px, width_px, CV_8U, cv::Scalar(level)));
    CHECK(cost.claims == 0);
    CHECK(cost.seconds < 1.5 * clean_frame().seconds);
  }
  CHECK(cost_of(cv::Mat(height_px, width_px, CV_16U, cv::Scalar(65535))).claims == 0);
}

TEST_CASE("hostile images: noise and blobs by the ten thousand take at most 12 times as long as a clean frame") {
  cv::Mat three_levels(height_px, width_px, CV_16U);
  std::mt19937 random(5);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x)
      three_levels.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(30000 * (random() % 3));
  }
  const auto check = [](const char* what, const cv::Mat& image) {
    const Cost cost = cost_of(image);
    INFO(what);
    CHECK(cost.claims == 0);
    CHECK(cost.seconds < 12.0 * clean_frame().seconds);  // 2 to 5 times when measured alone
  };
  check("three levels of 16 bit", three_levels);
  check("5 % salt and pepper", salt_and_pepper(0.05, CV_8U));
  check("salt and pepper all over, 16 bit", salt_and_pepper(1.0, CV_16U));
  check("60,000 blobs of 3 px", tiny_blobs(60000, 1));
  check("60,000 blobs of 5 px", tiny_blobs(60000, 2));
}

TEST_CASE("hostile images: each of 4,500 dots in broken rings takes at most a fiftieth of a clean frame") {
  int dots = 0;
  const cv::Mat image = dots_in_rings(dots);
  REQUIRE(dots > 4000);
  const Cost cost = cost_of(image);
  CHECK(cost.claims == 0);
  CHECK(cost.seconds < 0.02 * dots * clean_frame().seconds);  // a two-hundredth when measured alone
}

#ifndef __SANITIZE_ADDRESS__  // the sanitizer's own memory would be counted
TEST_CASE("hostile images: all of it stays below 40 bytes a pixel") {
  rusage usage{};
  REQUIRE(getrusage(RUSAGE_SELF, &usage) == 0);
  CHECK(static_cast<double>(usage.ru_maxrss) * 1024.0 < 40.0 * width_px * height_px);
}
#endif
