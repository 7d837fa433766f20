#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <opencv2/core.hpp>

#include "lib/result/result.h"

namespace imprint {

/// How a camera lays grey values into memory. Of colour formats with a plane of luminance that plane, as mono8.
enum class PixelFormat {
  mono8,
  mono10,  ///< in the low bits of 16, little endian; as the next two
  mono12,
  mono16,
  mono10_mipi,  ///< four pixels in 5 bytes: their high 8 bits, then the low bits of all (CSI-2)
  mono12_mipi,  ///< two pixels in 3 bytes, likewise
  mono10_pfnc,  ///< four pixels in 5 bytes, low bits first (GenICam Mono10p)
  mono12_pfnc,  ///< two pixels in 3 bytes, low bits first (GenICam Mono12p)
  mono12_gev,   ///< two pixels in 3 bytes as GigE Vision 1 has them (Mono12Packed)
  rgb8,         ///< colour in 3 bytes a pixel, as they lie in memory; the luminance (Rec. 601) is taken
  bgr8,
};

struct FormatName {
  PixelFormat format;
  std::string_view name;
  int bits;  ///< of a value
};

inline constexpr auto kPixelFormats = std::to_array<FormatName>({
    {PixelFormat::mono8, "mono8", 8},
    {PixelFormat::mono10, "mono10", 10},
    {PixelFormat::mono12, "mono12", 12},
    {PixelFormat::mono16, "mono16", 16},
    {PixelFormat::mono10_mipi, "mono10_mipi", 10},
    {PixelFormat::mono12_mipi, "mono12_mipi", 12},
    {PixelFormat::mono10_pfnc, "mono10_pfnc", 10},
    {PixelFormat::mono12_pfnc, "mono12_pfnc", 12},
    {PixelFormat::mono12_gev, "mono12_gev", 12},
    {PixelFormat::rgb8, "rgb8", 8},
    {PixelFormat::bgr8, "bgr8", 8},
});

std::string_view name_of(PixelFormat format);
/// Fails (invalid_input) listing the names there are.
Result<PixelFormat> pixel_format_from_name(std::string_view name);

/// A picture as it lies in a camera's buffer.
struct PixelLayout {
  PixelFormat format = PixelFormat::mono8;
  int width_px = 0;
  int height_px = 0;
  std::size_t stride_bytes = 0;  ///< from one row to the next; 0: rows follow without a gap
};

/// Bytes of one row without what may follow it.
std::size_t row_bytes(PixelFormat format, int width_px);

/// The picture in a buffer of its own: 8 bit for mono8 and colour, else 16 bit with the values spread over all 16, so
/// that full scale is 65535 whatever the sensor's depth. Fails (job_failed) when the buffer is too short for the
/// layout.
Result<cv::Mat> unpack(const PixelLayout& layout, std::span<const std::uint8_t> buffer);

}  // namespace imprint
