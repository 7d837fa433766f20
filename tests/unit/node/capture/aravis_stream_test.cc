#include "node/capture/aravis_stream.h"

#include <arv.h>

#include <catch2/catch.hpp>

#include "node/capture/frame_source.h"

namespace imprint {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// A GigE Vision camera of Aravis' own on loopback, whose pixels are its exposure in units of 100 us.
class FakeCamera {
 public:
  explicit FakeCamera(const char* serial) : camera_(arv_gv_fake_camera_new_full("127.0.0.1", serial, nullptr)) {
    arv_fake_camera_set_fill_pattern(
        arv_gv_fake_camera_get_fake_camera(camera_),
        [](ArvBuffer* buffer, void*, guint32 exposure_us, guint32, ArvPixelFormat) {
          auto* bytes = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, nullptr)));
          const int pixels = arv_buffer_get_image_width(buffer) * arv_buffer_get_image_height(buffer);
          std::fill(bytes, bytes + pixels, static_cast<std::uint8_t>(exposure_us / 100));
        },
        nullptr);
  }
  FakeCamera(const FakeCamera&) = delete;
  FakeCamera& operator=(const FakeCamera&) = delete;
  ~FakeCamera() { g_object_unref(camera_); }

  [[nodiscard]] bool running() const { return arv_gv_fake_camera_is_running(camera_) != 0; }

 private:
  ArvGvFakeCamera* camera_;
};

CameraSettings settings() {
  CameraSettings settings;
  settings.device = "Aravis-Fake-UNIT1";
  settings.width_px = 320;
  settings.height_px = 200;
  settings.exposure = {4200.0, 0.0};
  settings.frames_per_s = 50.0;
  settings.socket_buffer_mb = 0.2;  // what a machine allows without being asked
  return settings;
}

}  // namespace

TEST_CASE("aravis: ids of 16 bits go round, and 0 is none of them") {
  CHECK(missed_between(1, 2) == 0);
  CHECK(missed_between(1, 5) == 3);
  CHECK(missed_between(65'535, 1) == 0);
  CHECK(missed_between(65'534, 2) == 2);
  CHECK(missed_between(70'000, 70'002) == 1);
  CHECK(missed_between(500, 1) == 0);  // began anew
}

TEST_CASE("aravis: a camera that is not there is said to be missing") {
  CameraSettings wanted = settings();
  wanted.device = "Aravis-Fake-NOBODY";
  const auto opened = open_aravis_stream(wanted);
  REQUIRE_FALSE(opened);
  CHECK_THAT(opened.error().message, Catch::StartsWith("Aravis-Fake-NOBODY: no such camera"));
}

TEST_CASE("aravis: frames of a GigE camera come with content, exposure, time and sequence") {
  const FakeCamera camera("UNIT1");
  REQUIRE(camera.running());
  auto source = open_camera_source("aravis", settings(), "cam1");
  REQUIRE(source);
  const auto first = (*source)->capture({});
  INFO((first ? std::string() : first.error().message));
  REQUIRE(first);
  CHECK(first->image.size() == cv::Size(320, 200));
  CHECK(cv::countNonZero(first->image != 42) == 0);
  CHECK(first->exposure.time_us == 4200.0);
  REQUIRE((*source)->adjustable_exposure()->set_exposure({9900.0, 0.0}));
  auto next = (*source)->capture({});
  for (int i = 0; next && next->exposure.time_us != 9900.0 && i < 20; ++i) next = (*source)->capture({});
  REQUIRE(next);
  CHECK(next->exposure.time_us == 9900.0);
  CHECK(cv::countNonZero(next->image != 99) == 0);
  CHECK(next->sequence > first->sequence);
  CHECK(next->sensor_time_ns > first->sensor_time_ns);
}

TEST_CASE("aravis: software trigger takes one frame a command") {
  const FakeCamera camera("UNIT1");
  REQUIRE(camera.running());
  CameraSettings wanted = settings();
  wanted.trigger = CameraTrigger::software;
  auto stream = open_aravis_stream(wanted);
  REQUIRE(stream);
  CHECK_FALSE((*stream)->next(milliseconds(200)).value());
  for (int i = 0; i < 3; ++i) {
    REQUIRE((*stream)->fire());
    CHECK((*stream)->next(seconds(5)).value());
    CHECK_FALSE((*stream)->next(milliseconds(100)).value());
  }
}

TEST_CASE("aravis: a format or feature the camera does not have is refused with its name") {
  const FakeCamera camera("UNIT1");
  REQUIRE(camera.running());
  CameraSettings wanted = settings();
  wanted.format = PixelFormat::mono12_gev;
  auto refused = open_aravis_stream(wanted);
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error().message, Catch::Contains("camera.format: Mono12Packed"));
  wanted = settings();
  wanted.controls = {{"NoSuchFeature", "1"}};
  refused = open_aravis_stream(wanted);
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error().message, Catch::Contains("NoSuchFeature"));
}

}  // namespace imprint
