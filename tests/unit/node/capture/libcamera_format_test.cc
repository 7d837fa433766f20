#include "node/capture/libcamera_format.h"

#include <vector>

#include <libcamera/control_ids.h>
#include <libcamera/formats.h>
#include <catch2/catch.hpp>

#include "node/capture/libcamera_stream.h"

namespace imprint {
namespace {

namespace formats = libcamera::formats;
using Offer = std::vector<libcamera::PixelFormat>;

}  // namespace

TEST_CASE("libcamera: grey before luminance before colour, whatever the order they are offered in") {
  const auto chosen = [](const Offer& offer) {
    const auto format = choose_libcamera_format(PixelFormat::mono8, offer);
    REQUIRE(format);
    return *format;
  };
  CHECK(chosen({formats::RGB888, formats::NV12, formats::R8}).code == formats::R8);
  CHECK(chosen({formats::RGB888, formats::YUYV, formats::NV12}).code == formats::NV12);
  CHECK(chosen({formats::RGB888, formats::NV12}).layout == PixelFormat::mono8);
}

TEST_CASE("libcamera: colours are named from the highest byte, so RGB888 lies as blue, green, red") {
  CHECK(choose_libcamera_format(PixelFormat::mono8, Offer{formats::RGB888})->layout == PixelFormat::bgr8);
  CHECK(choose_libcamera_format(PixelFormat::mono8, Offer{formats::BGR888})->layout == PixelFormat::rgb8);
}

TEST_CASE("libcamera: deep formats are taken only as they are named, packed or not") {
  const Offer both{formats::R10_CSI2P, formats::R10};
  CHECK(choose_libcamera_format(PixelFormat::mono10, both)->code == formats::R10);
  CHECK(choose_libcamera_format(PixelFormat::mono10_mipi, both)->code == formats::R10_CSI2P);
  CHECK(choose_libcamera_format(PixelFormat::mono10_mipi, both)->layout == PixelFormat::mono10_mipi);
  const auto refused = choose_libcamera_format(PixelFormat::mono12, both);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message == "camera.format: the camera does not give mono12, but R10_CSI2P, R10");
}

TEST_CASE("libcamera: a format that needs demosaicing is not taken for grey") {
  const auto refused = choose_libcamera_format(PixelFormat::mono8, Offer{formats::SBGGR8, formats::YUYV});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message == "camera.format: the camera does not give mono8, but SBGGR8, YUYV");
}

TEST_CASE("libcamera: a control's text becomes a value of its type") {
  namespace controls = libcamera::controls;
  CHECK(libcamera_control_value(controls::AeEnable, "false")->get<bool>() == false);
  CHECK(libcamera_control_value(controls::ExposureTime, "1500")->get<std::int32_t>() == 1500);
  CHECK(libcamera_control_value(controls::Brightness, "-0.25")->get<float>() == -0.25F);
  const auto refused = libcamera_control_value(controls::ExposureTime, "1500us");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message == "ExposureTime: expected a whole number, found \"1500us\"");
  CHECK_FALSE(libcamera_control_value(controls::AeEnable, "on"));
  CHECK_FALSE(libcamera_control_value(controls::FrameDuration, "99999999999999999999"));
}

TEST_CASE("libcamera: 20 dB are a gain of 10, and back") {
  CHECK(gain_factor(20.0) == Approx(10.0));
  CHECK(gain_db(2.0) == Approx(6.0206).margin(1e-4));
  CHECK(gain_db(0.0) == 0.0);
}

TEST_CASE("libcamera: a frame's exposure is what the camera says of it, else what was asked for") {
  const Exposure asked{2000.0, 3.0};
  libcamera::ControlList said(libcamera::controls::controls);
  CHECK(exposure_of(said, asked).time_us == 2000.0);
  said.set(libcamera::controls::ExposureTime, 1987);
  CHECK(exposure_of(said, asked).time_us == 1987.0);
  CHECK(exposure_of(said, asked).gain_db == 3.0);
  said.set(libcamera::controls::AnalogueGain, 10.0F);
  CHECK(exposure_of(said, asked).gain_db == Approx(20.0));
}

TEST_CASE("libcamera: a damaged frame is a picture, one of a camera that still settles or was cancelled is not") {
  CHECK(is_picture(libcamera::FrameMetadata::FrameSuccess));
  CHECK(is_picture(libcamera::FrameMetadata::FrameError));
  CHECK_FALSE(is_picture(libcamera::FrameMetadata::FrameCancelled));
  CHECK_FALSE(is_picture(static_cast<libcamera::FrameMetadata::Status>(3)));  // FrameStartup; 0.0.3 has no name for it
}

TEST_CASE("libcamera: a camera that is not there is an error that names it, time after time") {
  CameraSettings settings;
  settings.device = "/base/no/such/camera";
  for (int attempt = 0; attempt < 2; ++attempt) {
    const auto refused = open_libcamera_stream(settings);
    REQUIRE_FALSE(refused);
    CHECK_THAT(refused.error().message, Catch::StartsWith("/base/no/such/camera: no such camera: camera.device: "));
  }
}

TEST_CASE("libcamera: a trigger by software is refused before the camera is touched") {
  CameraSettings settings;
  settings.trigger = CameraTrigger::software;
  const auto refused = open_libcamera_stream(settings);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message ==
        "the only camera: libcamera knows no trigger by software; camera.trigger: free or hardware");
}

}  // namespace imprint
