// Run in a guest whose kernel has the vivid driver at /dev/video0 (tests/boards/vivid.py): frames by content, faults by
// vivid's own injection.
#include <linux/v4l2-dv-timings.h>
#include <linux/videodev2.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include <catch2/catch.hpp>

#include "lib/clock/wall_clock.h"
#include "node/capture/frame_source.h"
#include "node/capture/v4l2_controls.h"

namespace imprint {
namespace {

using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr int kHdmi = 3;             // vivid's input that takes any size
constexpr int kPaintedWidth = 4096;  // vivid paints no further
constexpr int kPaintedHeight = 2160;
constexpr auto kPatience = seconds(60);  // the guest is emulated

CameraSettings sixteen_megapixels(PixelFormat format, const std::string& pattern) {
  CameraSettings settings;
  settings.device = "/dev/video0";
  settings.input = kHdmi;
  settings.width_px = 4656;
  settings.height_px = 3520;
  settings.format = format;
  settings.buffers = 4;
  settings.recent_frames = 2;
  settings.stall_s = 30.0;
  settings.controls = {{"test_pattern", pattern}, {"osd_text_mode", "2"}};  // 2: no text in the picture
  return settings;
}

// Vivid's patterns by their place in its menu.
constexpr const char* kBlack = "5";
constexpr const char* kWhite = "6";
constexpr const char* kRamp = "20";

// What is at the HDMI input: the largest picture that vivid paints.
void plug_in_hdmi() {
  auto device = open_v4l2_device("/dev/video0");
  REQUIRE(device);
  int input = kHdmi;
  REQUIRE((*device)->call(VIDIOC_S_INPUT, &input) == 0);
  v4l2_dv_timings timings V4L2_DV_BT_DMT_4096X2160P60_RB;
  REQUIRE((*device)->call(VIDIOC_S_DV_TIMINGS, &timings) == 0);
}

std::unique_ptr<FrameSource> open(const CameraSettings& settings) {
  if (settings.input == kHdmi) plug_in_hdmi();
  auto source = open_camera_source("v4l2", settings, "cam1");
  REQUIRE(source);
  return std::move(*source);
}

// Frames are slow here: asked for again until one comes.
Frame frame_of(FrameSource& source) {
  const auto deadline = steady_clock::now() + kPatience;
  while (true) {
    auto frame = source.capture({});
    if (frame) return std::move(*frame);
    INFO(frame.error().message);
    REQUIRE(steady_clock::now() < deadline);
  }
}

cv::Mat painted(const Frame& frame) { return frame.image(cv::Rect(0, 0, kPaintedWidth, kPaintedHeight)); }

void inject(const std::string& control, std::int64_t value) {
  auto device = open_v4l2_device("/dev/video0");
  REQUIRE(device);
  REQUIRE(V4l2Controls(*device).set(control, value));
}

// "unbind" takes the camera away, its device file with it; "bind" brings it back.
void tell_driver(const std::string& what) {
  std::ofstream file("/sys/bus/platform/drivers/vivid/" + what);
  file << "vivid.0" << std::flush;
  REQUIRE(file.good());
}

}  // namespace

TEST_CASE("vivid: 4656 x 3520 in 8, 10 and 16 bit, black is black and white is white") {
  for (const PixelFormat format : {PixelFormat::mono8, PixelFormat::mono10, PixelFormat::mono16}) {
    CAPTURE(name_of(format));
    const double full = format == PixelFormat::mono8 ? 255.0 : 65535.0;
    for (const auto& [pattern, level] : {std::pair{kBlack, 0.0}, std::pair{kWhite, 1.0}}) {
      const Frame frame = frame_of(*open(sixteen_megapixels(format, pattern)));
      REQUIRE(frame.image.size() == cv::Size(4656, 3520));
      REQUIRE(frame.image.depth() == (format == PixelFormat::mono8 ? CV_8U : CV_16U));
      double lowest = 0.0;
      double highest = 0.0;
      cv::minMaxLoc(painted(frame), &lowest, &highest);
      // Limited range, as on HDMI: black is 16 and white 235 of 255; full range: 0 and 255.
      CHECK(lowest >= (level == 0.0 ? 0.0 : 0.9 * full));
      CHECK(highest <= (level == 0.0 ? 0.07 * full : full));
    }
  }
}

TEST_CASE("vivid: a ramp rises along its rows in 16 bit, and all rows are alike") {
  const Frame frame = frame_of(*open(sixteen_megapixels(PixelFormat::mono16, kRamp)));
  const cv::Mat ramp = painted(frame);
  double largest_difference = cv::norm(ramp.row(10), ramp.row(2000), cv::NORM_INF);
  CHECK(largest_difference == 0.0);
  int falls = 0;
  for (int x = 1; x < ramp.cols; ++x) falls += ramp.at<std::uint16_t>(0, x) < ramp.at<std::uint16_t>(0, x - 1) ? 1 : 0;
  CHECK(falls == 0);
  CHECK(ramp.at<std::uint16_t>(0, ramp.cols - 1) - ramp.at<std::uint16_t>(0, 0) > 50'000);
}

TEST_CASE("vivid: frames carry the sensor's time and a sequence that counts on") {
  const auto source = open(sixteen_megapixels(PixelFormat::mono8, kBlack));
  const Frame first = frame_of(*source);
  const Frame second = frame_of(*source);
  CHECK(second.sequence > first.sequence);
  CHECK(second.sensor_time_ns > first.sensor_time_ns);
  CHECK(std::abs(wall_clock_ns() - second.sensor_time_ns) < 30'000'000'000);  // the guest is emulated
}

TEST_CASE("vivid: dropped buffers are counted and frames come all the same") {
  CameraSettings settings = sixteen_megapixels(PixelFormat::mono8, kBlack);
  settings.input = 0;  // the webcam: small and quick
  settings.width_px = 640;
  settings.height_px = 360;
  settings.controls.push_back({"percentage_of_dropped_buffers", "60"});
  const auto source = open(settings);
  const auto deadline = steady_clock::now() + kPatience;
  while (source->status()->dropped < 5 && steady_clock::now() < deadline) frame_of(*source);
  CHECK(source->status()->dropped >= 5);
  CHECK(source->status()->restarts == 0);
  inject("percentage_of_dropped_buffers", 0);
}

TEST_CASE("vivid: a camera that fails while it streams is opened anew") {
  const auto source = open(sixteen_megapixels(PixelFormat::mono8, kBlack));
  frame_of(*source);
  inject("inject_fatal_streaming_error", 1);
  const auto deadline = steady_clock::now() + kPatience;
  while (source->status()->restarts == 0 && steady_clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  CHECK(source->status()->restarts == 1);
  frame_of(*source);
  CHECK(source->status()->fault.empty());
}

TEST_CASE("vivid: a camera that is unplugged and plugged in again gives frames again") {
  const auto source = open(sixteen_megapixels(PixelFormat::mono8, kBlack));
  frame_of(*source);
  inject("disconnect", 1);  // vivid comes back when the last has let go of it
  const auto deadline = steady_clock::now() + kPatience;
  while (source->status()->restarts == 0 && steady_clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  CHECK(source->status()->restarts >= 1);
  frame_of(*source);
  CHECK(source->status()->fault.empty());
}

TEST_CASE("vivid: a camera that is unplugged and stays away is a fault by name, and gives frames when it is back") {
  CameraSettings settings = sixteen_megapixels(PixelFormat::mono8, kBlack);
  settings.input = 0;
  settings.width_px = 640;
  settings.height_px = 360;
  const auto source = open(settings);
  frame_of(*source);
  tell_driver("unbind");
  const auto deadline = steady_clock::now() + kPatience;
  const auto waits = [&] { return source->status()->fault.find("No such file") == std::string::npos; };
  while (waits() && steady_clock::now() < deadline) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  CHECK_THAT(source->status()->fault, Catch::Contains("/dev/video0"));
  CHECK_FALSE(std::filesystem::exists("/dev/video0"));
  const auto refused = source->capture({});
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error().message, Catch::Contains("/dev/video0"));
  tell_driver("bind");
  frame_of(*source);
  CHECK(source->status()->fault.empty());
  CHECK(source->status()->restarts >= 1);
}

TEST_CASE("vivid: an error when streaming begins, and a buffer with an error, are survived") {
  const auto settings = sixteen_megapixels(PixelFormat::mono8, kBlack);
  plug_in_hdmi();
  inject("inject_vidioc_streamon_error", 1);
  const auto source = open(settings);
  frame_of(*source);
  inject("inject_v4l2_buf_flag_error", 1);
  const auto deadline = steady_clock::now() + kPatience;
  while (source->status()->dropped == 0 && steady_clock::now() < deadline) frame_of(*source);
  CHECK(source->status()->dropped >= 1);
}

}  // namespace imprint
