#include "node/capture/v4l2_stream.h"

#include <time.h>

#include <catch2/catch.hpp>

#include "lib/clock/wall_clock.h"
#include "tests/unit/node/capture/fake_v4l2.h"

namespace imprint {
namespace {

using std::chrono::milliseconds;

CameraSettings settings() {
  CameraSettings settings;
  settings.device = "/dev/fake";
  settings.width_px = 64;
  settings.height_px = 4;
  settings.format = PixelFormat::mono10;
  settings.buffers = 4;
  settings.recent_frames = 2;
  return settings;
}

Result<std::unique_ptr<CameraStream>> open(const std::shared_ptr<FakeV4l2>& device, const CameraSettings& wanted) {
  return open_v4l2_stream(wanted, [&](const std::string&) -> Result<std::shared_ptr<V4l2Device>> { return device; });
}

std::string refusal(const std::shared_ptr<FakeV4l2>& device, const CameraSettings& wanted) {
  const auto opened = open(device, wanted);
  REQUIRE_FALSE(opened);
  REQUIRE(opened.error().exit_status() == 1);
  return opened.error().message;
}

RawFrame frame_of(CameraStream& stream) {
  auto frame = stream.next(milliseconds(0));
  REQUIRE(frame);
  REQUIRE(*frame);
  return std::move(**frame);
}

std::int64_t monotonic_us() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000LL + now.tv_nsec / 1000;
}

}  // namespace

TEST_CASE("v4l2: frames come with their content, the driver's sequence and its stamp on the wall clock") {
  for (const std::uint32_t kind : {V4L2_CAP_VIDEO_CAPTURE, V4L2_CAP_VIDEO_CAPTURE_MPLANE}) {
    const auto device = std::make_shared<FakeV4l2>();
    device->capabilities = kind | V4L2_CAP_STREAMING;
    const auto stream = open(device, settings());
    REQUIRE(stream);
    CHECK(device->streaming);
    CHECK_FALSE((*stream)->next(milliseconds(0)).value());
    device->arrive(0x01, 41, monotonic_us() - 250'000);
    const RawFrame frame = frame_of(**stream);
    CHECK(frame.sequence == 41);
    CHECK_FALSE(frame.damaged);
    // The stamp has microseconds; between its making and its reading the machine may rest for a while.
    CHECK(std::abs(wall_clock_ns() - 250'000'000 - frame.sensor_time_ns) < 200'000'000);
    const auto image = unpack(frame.layout, frame.bytes);
    REQUIRE(image);
    CHECK(image->size() == cv::Size(64, 4));
    CHECK(image->at<std::uint16_t>(3, 63) == (0x101 << 6 | 0x101 >> 4));
  }
}

TEST_CASE("v4l2: a frame's buffer goes back to the camera with its last copy") {
  const auto device = std::make_shared<FakeV4l2>();
  const auto stream = open(device, settings());
  REQUIRE(stream);
  REQUIRE(device->queued() == 4);
  device->arrive(1, 0, 0);
  {
    const RawFrame frame = frame_of(**stream);
    const RawFrame copy = frame;
    CHECK(device->queued() == 3);
  }
  CHECK(device->queued() == 4);
}

TEST_CASE("v4l2: gaps in the sequence are missed frames, over the wrap of its 32 bits too") {
  const auto device = std::make_shared<FakeV4l2>();
  const auto stream = open(device, settings());
  REQUIRE(stream);
  const auto missed = [&](std::uint32_t sequence) {
    REQUIRE(device->arrive(0, sequence, 0));
    return frame_of(**stream).missed;
  };
  CHECK(missed(4'294'967'290) == 0);
  CHECK(missed(4'294'967'291) == 0);
  CHECK(missed(4'294'967'294) == 2);
  CHECK(missed(1) == 2);
  CHECK(missed(0) == 0);  // began anew
}

TEST_CASE("v4l2: a buffer with an error is damaged, a device that is gone is lost") {
  const auto device = std::make_shared<FakeV4l2>();
  const auto stream = open(device, settings());
  REQUIRE(stream);
  device->arrive(0, 7, 0, V4L2_BUF_FLAG_ERROR);
  CHECK(frame_of(**stream).damaged);
  for (const int fault : {EIO, ENODEV}) {
    device->faults[VIDIOC_DQBUF] = fault;
    const auto lost = (*stream)->next(milliseconds(0));
    REQUIRE_FALSE(lost);
    CHECK(lost.error().message == fmt::format("/dev/fake: lost: {}", std::strerror(fault)));
  }
  device->faults.clear();
  CHECK((*stream)->next(milliseconds(0)));
}

TEST_CASE("v4l2: a frame outlives the stream that gave it") {
  const auto device = std::make_shared<FakeV4l2>();
  auto stream = open(device, settings());
  REQUIRE(stream);
  device->arrive(3, 0, 0);
  const RawFrame frame = frame_of(**stream);
  stream->reset();
  CHECK_FALSE(device->streaming);
  CHECK(unpack(frame.layout, frame.bytes)->at<std::uint16_t>(0, 0) == (0x303 << 6 | 0x303 >> 4));
}

TEST_CASE("v4l2: exposure and gain go in the control's units and come back as the driver has them") {
  const auto device = std::make_shared<FakeV4l2>();
  CameraSettings wanted = settings();
  wanted.gain_unit_db = 0.1;
  wanted.exposure = {1230.0, 6.0};
  const auto stream = open(device, wanted);
  REQUIRE(stream);
  CHECK(device->controls[0].value == 12);
  CHECK(device->controls[1].value == 60);
  CHECK((*stream)->exposure().time_us == 1200.0);
  CHECK((*stream)->exposure().gain_db == Approx(6.0));
  const auto refused = (*stream)->set_exposure({1e6, 0.0});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message == "/dev/fake: control exposure_time_absolute: expected 1 to 5000, found 10000");
}

TEST_CASE("v4l2: gain in a unit nobody has told is refused, not guessed") {
  const auto device = std::make_shared<FakeV4l2>();
  const auto stream = open(device, settings());
  REQUIRE(stream);
  CHECK((*stream)->set_exposure({1000.0, 0.0}));
  CHECK_FALSE((*stream)->set_exposure({1000.0, 3.0}));
}

TEST_CASE("v4l2: what the camera does not give is said with what it gives") {
  const auto device = std::make_shared<FakeV4l2>();
  CameraSettings wanted = settings();
  wanted.format = PixelFormat::mono12;
  CHECK(refusal(device, wanted) ==
        "/dev/fake: camera.format: the camera does not give mono12, but mono8 (GREY), mono10 (Y10)");
  wanted = settings();
  wanted.width_px = 5000;
  CHECK_THAT(refusal(device, wanted), Catch::Contains("expected 5000 x 4 px Y10, the camera gives 4656 x 4 px Y10"));
  wanted = settings();
  wanted.controls = {{"brightness", "1"}};
  CHECK(refusal(device, wanted) ==
        "/dev/fake: camera.controls: no control \"brightness\", but exposure_time_absolute, gain");
  wanted.controls = {{"gain", "much"}};
  CHECK_THAT(refusal(device, wanted), Catch::Contains("gain: expected a whole number, found \"much\""));
  device->max_buffers = 2;
  CHECK_THAT(refusal(device, settings()), Catch::Contains("camera.buffers: expected 4, the camera has memory for 2"));
  wanted = settings();
  wanted.trigger = CameraTrigger::software;
  CHECK_THAT(refusal(device, wanted), Catch::Contains("no trigger by software"));
  device->capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  CHECK(refusal(device, settings()) == "/dev/fake: this device does not capture pictures");
}

TEST_CASE("v4l2: a request that fails ends the opening with its reason") {
  for (const unsigned long request :
       {VIDIOC_QUERYCAP, VIDIOC_G_FMT, VIDIOC_S_FMT, VIDIOC_REQBUFS, VIDIOC_QUERYBUF, VIDIOC_QBUF, VIDIOC_STREAMON}) {
    const auto device = std::make_shared<FakeV4l2>();
    device->faults[request] = EBUSY;
    CHECK_THAT(refusal(device, settings()), Catch::StartsWith("/dev/fake: ") && Catch::Contains(std::strerror(EBUSY)));
    CHECK_FALSE(device->streaming);
  }
}

TEST_CASE("v4l2: a path that is no device says so") {
  CameraSettings wanted = settings();
  wanted.device = "/dev/imprint-no-such-camera";
  const auto opened = open_v4l2_stream(wanted);
  REQUIRE_FALSE(opened);
  CHECK(opened.error().message == "/dev/imprint-no-such-camera: No such file or directory");
  wanted.device = "/dev/null";
  CHECK_FALSE(open_v4l2_stream(wanted));
}

}  // namespace imprint
