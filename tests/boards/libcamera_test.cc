// Run in guests (tests/boards/libcamera.py): libcamera 0.0.3 with the kernel's vimc driver, [vimc], 0.4 and 0.7 with
// their virtual pipeline, [virtual]. All show eight bars from white to black, whose luminance falls from left to right.
#include <algorithm>
#include <chrono>
#include <vector>

#include <catch2/catch.hpp>

#include "lib/clock/wall_clock.h"
#include "node/capture/libcamera_stream.h"
#include "node/capture/live_source.h"

namespace imprint {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr auto kPatience = milliseconds(240'000);  // the guest is emulated
constexpr int kBars = 8;
constexpr int kBlur = 6;        // px; demosaicing mixes colours where they meet, not in all rows alike
constexpr int kFirstRow = 400;  // below what vimc writes into its picture

CameraSettings vimc() {
  CameraSettings settings;
  settings.device = "platform/vimc.0 Sensor B";
  settings.width_px = 4092;  // what libcamera 0.0.3 makes of 4096
  settings.height_px = 2160;
  settings.recent_frames = 2;
  return settings;
}

CameraSettings virtual_camera() {
  CameraSettings settings;
  settings.device = "Virtual0";
  settings.width_px = 4656;
  settings.height_px = 3520;
  settings.recent_frames = 2;
  return settings;
}

std::unique_ptr<LiveSource> open(const CameraSettings& settings) {
  LiveConfig config;
  config.recent_frames = static_cast<std::size_t>(settings.recent_frames);
  config.frame_wait = kPatience;
  config.stall = kPatience;
  const auto opener = [settings](const Exposure&) { return open_libcamera_stream(settings); };
  return std::make_unique<LiveSource>("camera", opener, config);
}

Frame frame_of(FrameSource& source) {
  auto frame = source.capture({});
  if (!frame) FAIL(frame.error().message);
  return std::move(*frame);
}

struct Bar {
  int begin = 0;
  int width = 0;
  int level = 0;
};

// Runs of one level along a row, those narrower than a tenth of a bar left out: where colours meet they are blurred.
std::vector<Bar> bars_of(const cv::Mat& row) {
  std::vector<Bar> bars;
  for (int x = 0; x < row.cols; ++x) {
    const int level = row.at<std::uint8_t>(0, x);
    if (bars.empty() || std::abs(level - bars.back().level) > 2) {
      bars.push_back({x, 1, level});
    } else {
      ++bars.back().width;
    }
  }
  std::erase_if(bars, [&](const Bar& bar) { return bar.width < row.cols / kBars / 10; });
  return bars;
}

// The row begins anywhere: from white on it falls in even steps to black.
void check_bars(const cv::Mat& image) {
  REQUIRE(image.type() == CV_8UC1);
  const std::vector<Bar> bars = bars_of(image.row(kFirstRow));
  for (const Bar& bar : bars) UNSCOPED_INFO("bar at " << bar.begin << ", " << bar.width << " px, level " << bar.level);
  CHECK(bars.size() >= static_cast<std::size_t>(kBars));
  CHECK(bars.size() <= static_cast<std::size_t>(kBars) + 1);
  int rises = 0;
  for (std::size_t i = 1; i < bars.size(); ++i) rises += bars[i].level > bars[i - 1].level ? 1 : 0;
  CHECK(rises <= 1);
  const auto [darkest, brightest] = std::ranges::minmax(bars, {}, &Bar::level);
  CHECK(darkest.level <= 20);
  CHECK(brightest.level >= 180);
  for (int y = kFirstRow; y < image.rows; y += 97) {
    CAPTURE(y);
    const std::vector<Bar> others = bars_of(image.row(y));
    REQUIRE(others.size() == bars.size());
    for (std::size_t i = 0; i < bars.size(); ++i) {
      CHECK(std::abs(others[i].begin - bars[i].begin) <= kBlur);
      CHECK(std::abs(others[i].level - bars[i].level) <= 1);
    }
  }
}

void check_time_and_sequence(FrameSource& source) {
  const Frame first = frame_of(source);
  const Frame second = frame_of(source);
  CHECK(second.sequence > first.sequence);
  CHECK(second.sensor_time_ns > first.sensor_time_ns);
  CHECK(std::abs(wall_clock_ns() - second.sensor_time_ns) < 60'000'000'000);  // the guest is emulated
}

}  // namespace

TEST_CASE("vimc: 4092 x 2160, its colour bars as luminance", "[vimc]") {
  const auto source = open(vimc());
  check_bars(frame_of(*source).image);
}

TEST_CASE("vimc: frames carry the sensor's time and a sequence that counts on", "[vimc]") {
  const auto source = open(vimc());
  check_time_and_sequence(*source);
  CHECK(source->status()->restarts == 0);
}

TEST_CASE("vimc: what the camera does not have is an error that lists what it has", "[vimc]") {
  CameraSettings deep = vimc();
  deep.format = PixelFormat::mono10;
  const auto refused = open_libcamera_stream(deep);
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error().message, Catch::Contains("does not give mono10, but") && Catch::Contains("RGB888"));
  CameraSettings exposed = vimc();
  exposed.exposure.time_us = 2000.0;
  const auto fixed = open_libcamera_stream(exposed);
  REQUIRE_FALSE(fixed);
  CHECK_THAT(fixed.error().message, Catch::Contains("exposure 2000 us: the camera's exposure cannot be set"));
  CameraSettings named = vimc();
  named.controls = {{"Shine", "1"}};
  const auto unknown = open_libcamera_stream(named);
  REQUIRE_FALSE(unknown);
  CHECK_THAT(unknown.error().message, Catch::Contains("\"Shine\": the camera has") && Catch::Contains("Brightness"));
}

TEST_CASE("vimc: a control changes the picture", "[vimc]") {
  const double plain = cv::mean(frame_of(*open(vimc())).image)[0];
  CameraSettings darker = vimc();
  darker.controls = {{"Brightness", "-0.5"}};
  const double dark = cv::mean(frame_of(*open(darker)).image)[0];
  CHECK(dark < plain - 20.0);
}

TEST_CASE("vimc: a second user is refused while the first has the camera, and takes it after", "[vimc]") {
  auto first = open_libcamera_stream(vimc());
  REQUIRE(first);
  const auto second = open_libcamera_stream(vimc());
  REQUIRE_FALSE(second);
  CHECK_THAT(second.error().message, Catch::Contains("is in use by another"));
  first->reset();
  CHECK(open_libcamera_stream(vimc()));
}

TEST_CASE("virtual: 4656 x 3520, the luminance of its colour bars", "[virtual]") {
  const auto source = open(virtual_camera());
  check_bars(frame_of(*source).image);
}

TEST_CASE("virtual: frames carry the sensor's time and a sequence that counts on", "[virtual][counts]") {
  const auto source = open(virtual_camera());
  check_time_and_sequence(*source);
  CHECK(source->status()->restarts == 0);
}

TEST_CASE("virtual: a held frame does not change while others come", "[virtual]") {
  CameraSettings small = virtual_camera();  // 0.4 takes its time to draw
  small.device = "Virtual1";
  small.width_px = 1280;
  small.height_px = 720;
  auto stream = open_libcamera_stream(small);
  REQUIRE(stream);
  std::optional<RawFrame> held;
  int others = 0;
  cv::Mat before;
  const auto deadline = steady_clock::now() + kPatience;
  while (others < 6 && steady_clock::now() < deadline) {
    auto frame = (*stream)->next(milliseconds(1000));
    REQUIRE(frame);
    if (!*frame) continue;
    if (held) {
      ++others;
      continue;
    }
    held = std::move(**frame);
    before = *unpack(held->layout, held->bytes);
  }
  CHECK(others == 6);
  REQUIRE(held);
  CHECK(cv::norm(before, *unpack(held->layout, held->bytes), cv::NORM_INF) == 0.0);
  stream->reset();  // and its memory outlives the camera
  CHECK(cv::norm(before, *unpack(held->layout, held->bytes), cv::NORM_INF) == 0.0);
}

}  // namespace imprint
