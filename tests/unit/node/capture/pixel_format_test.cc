#include "node/capture/pixel_format.h"

#include <vector>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

// Lays values of `bits` into bytes as the formats' definitions say, apart from the code under test.
std::vector<std::uint8_t> pack(PixelFormat format, const std::vector<unsigned>& values) {
  std::vector<std::uint8_t> bytes(row_bytes(format, static_cast<int>(values.size())), 0);
  const auto set_bits = [&](std::size_t at, unsigned value, unsigned bits) {  // least significant first
    for (unsigned bit = 0; bit < bits; ++bit)
      if ((value >> bit & 1U) != 0U) bytes[(at + bit) / 8] |= static_cast<std::uint8_t>(1U << (at + bit) % 8);
  };
  for (std::size_t i = 0; i < values.size(); ++i) {
    const unsigned value = values[i];
    switch (format) {
      case PixelFormat::mono8:
        set_bits(8 * i, value, 8);
        break;
      case PixelFormat::mono10:
      case PixelFormat::mono12:
      case PixelFormat::mono16:
        set_bits(16 * i, value, 16);
        break;
      case PixelFormat::mono10_mipi:
        set_bits(40 * (i / 4) + 8 * (i % 4), value >> 2U, 8);
        set_bits(40 * (i / 4) + 32 + 2 * (i % 4), value & 3U, 2);
        break;
      case PixelFormat::mono12_mipi:
        set_bits(24 * (i / 2) + 8 * (i % 2), value >> 4U, 8);
        set_bits(24 * (i / 2) + 16 + 4 * (i % 2), value & 15U, 4);
        break;
      case PixelFormat::mono10_pfnc:
        set_bits(10 * i, value, 10);
        break;
      case PixelFormat::mono12_pfnc:
        set_bits(12 * i, value, 12);
        break;
      case PixelFormat::mono12_gev:
        set_bits(24 * (i / 2) + 16 * (i % 2), value >> 4U, 8);
        set_bits(24 * (i / 2) + 8 + 4 * (i % 2), value & 15U, 4);
        break;
      case PixelFormat::rgb8:  // grey: three times the same
      case PixelFormat::bgr8:
        for (const std::size_t channel : {0U, 1U, 2U}) set_bits(24 * i + 8 * channel, value, 8);
        break;
    }
  }
  return bytes;
}

}  // namespace

TEST_CASE("pixels: every format gives each value back at its place, full scale as full scale") {
  for (const FormatName& entry : kPixelFormats) {
    CAPTURE(entry.name);
    const unsigned highest = (1U << static_cast<unsigned>(entry.bits)) - 1U;
    std::vector<unsigned> values;  // 7 of them: the last group of a packed row is not full
    for (unsigned i = 0; i < 6; ++i) values.push_back((i * 2654435761U >> 7U) & highest);
    values.push_back(highest);
    const auto image = unpack({entry.format, 7, 1, 0}, pack(entry.format, values));
    REQUIRE(image);
    const double full = entry.bits == 8 ? 255.0 : 65535.0;
    REQUIRE(image->type() == (entry.bits == 8 ? CV_8UC1 : CV_16UC1));
    for (int x = 0; x < 7; ++x) {
      const double found = image->depth() == CV_8U ? image->at<std::uint8_t>(0, x) : image->at<std::uint16_t>(0, x);
      // Spreading 10 or 12 bits over 16 by repeating the high ones is off the straight line by less than one.
      CHECK(std::abs(found - full * values[static_cast<std::size_t>(x)] / highest) < 1.0);
    }
    CHECK((image->depth() == CV_8U ? image->at<std::uint8_t>(0, 6) : image->at<std::uint16_t>(0, 6)) == full);
  }
}

TEST_CASE("pixels: what stands behind a row is not of the picture") {
  const std::vector<std::uint8_t> bytes{1, 2, 99, 99, 3, 4};  // the last row ends with its pixels
  const auto image = unpack({PixelFormat::mono8, 2, 2, 4}, bytes);
  REQUIRE(image);
  CHECK(cv::countNonZero(*image != cv::Mat_<std::uint8_t>({2, 2}, {1, 2, 3, 4})) == 0);
}

TEST_CASE("pixels: a buffer that is too short is an error, not a read beyond it") {
  const std::vector<std::uint8_t> bytes(11);
  const auto image = unpack({PixelFormat::mono16, 3, 2, 0}, bytes);
  REQUIRE_FALSE(image);
  CHECK(image.error().message == "11 bytes came, 3 x 2 px mono16 take 12");
  CHECK_FALSE(unpack({PixelFormat::mono8, 0, 2, 0}, bytes));
  CHECK_FALSE(unpack({PixelFormat::mono8, 6, 1, 5}, bytes));
}

TEST_CASE("pixels: names lead back to their formats, another name lists them") {
  for (const FormatName& entry : kPixelFormats) CHECK(pixel_format_from_name(entry.name) == entry.format);
  const auto refused = pixel_format_from_name("bayer");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message ==
        "pixel format \"bayer\": expected one of mono8, mono10, mono12, mono16, mono10_mipi, mono12_mipi, "
        "mono10_pfnc, mono12_pfnc, mono12_gev, rgb8, bgr8");
}

TEST_CASE("pixels: the luminance of colour is that of Rec. 601, red first or blue first") {
  const std::vector<std::uint8_t> bytes{255, 0, 0, 0, 255, 0, 99, 0, 0, 255, 255, 255, 255};  // rows of 7 bytes
  const cv::Mat_<std::uint8_t> red_first = (cv::Mat_<std::uint8_t>(2, 2) << 76, 150, 29, 255);
  const cv::Mat_<std::uint8_t> blue_first = (cv::Mat_<std::uint8_t>(2, 2) << 29, 150, 76, 255);
  for (const auto& [format, expected] : {std::pair{PixelFormat::rgb8, red_first}, {PixelFormat::bgr8, blue_first}}) {
    const auto image = unpack({format, 2, 2, 7}, bytes);
    REQUIRE(image);
    CHECK(cv::norm(*image, expected, cv::NORM_INF) == 0.0);
  }
}

}  // namespace imprint
