#include "node/capture/pixel_format.h"

#include <algorithm>
#include <cstring>

#include <opencv2/imgproc.hpp>

namespace imprint {
namespace {

const FormatName& entry_of(PixelFormat format) {
  return *std::ranges::find(kPixelFormats, format, &FormatName::format);
}

// The high bits again below the low ones: 0 stays 0, full scale becomes 65535, and in between it is linear.
constexpr std::uint16_t spread10(unsigned value) { return static_cast<std::uint16_t>(value << 6U | value >> 4U); }
constexpr std::uint16_t spread12(unsigned value) { return static_cast<std::uint16_t>(value << 4U | value >> 8U); }

unsigned word(const std::uint8_t* at) { return at[0] | static_cast<unsigned>(at[1]) << 8U; }

// Pixel `x` of a row, spread to 16 bits.
template <PixelFormat format>
std::uint16_t pixel(const std::uint8_t* row, int x) {
  const auto column = static_cast<std::size_t>(x);
  if constexpr (format == PixelFormat::mono10) {
    return spread10(word(row + 2 * column) & 0x3FFU);
  } else if constexpr (format == PixelFormat::mono12) {
    return spread12(word(row + 2 * column) & 0xFFFU);
  } else if constexpr (format == PixelFormat::mono16) {
    return static_cast<std::uint16_t>(word(row + 2 * column));
  } else if constexpr (format == PixelFormat::mono10_mipi) {
    const std::uint8_t* group = row + 5 * (column / 4);
    const std::size_t place = column % 4;
    return spread10(static_cast<unsigned>(group[place]) << 2U | (group[4] >> (2 * place) & 3U));
  } else if constexpr (format == PixelFormat::mono12_mipi) {
    const std::uint8_t* group = row + 3 * (column / 2);
    const std::size_t place = column % 2;
    return spread12(static_cast<unsigned>(group[place]) << 4U | (group[2] >> (4 * place) & 15U));
  } else if constexpr (format == PixelFormat::mono10_pfnc) {
    const std::size_t bit = 10 * column;
    return spread10(word(row + bit / 8) >> bit % 8 & 0x3FFU);
  } else if constexpr (format == PixelFormat::mono12_pfnc) {
    const std::size_t bit = 12 * column;
    return spread12(word(row + bit / 8) >> bit % 8 & 0xFFFU);
  } else {
    static_assert(format == PixelFormat::mono12_gev);
    const std::uint8_t* group = row + 3 * (column / 2);
    const std::size_t place = column % 2;
    return spread12(static_cast<unsigned>(group[2 * place]) << 4U | (group[1] >> (4 * place) & 15U));
  }
}

template <PixelFormat format>
void unpack_row(const std::uint8_t* row, std::uint16_t* out, int width_px) {
  for (int x = 0; x < width_px; ++x) out[x] = pixel<format>(row, x);
}

using UnpackRow = void (*)(const std::uint8_t*, std::uint16_t*, int);

UnpackRow row_unpacker(PixelFormat format) {
  switch (format) {
    case PixelFormat::mono10:
      return unpack_row<PixelFormat::mono10>;
    case PixelFormat::mono12:
      return unpack_row<PixelFormat::mono12>;
    case PixelFormat::mono10_mipi:
      return unpack_row<PixelFormat::mono10_mipi>;
    case PixelFormat::mono12_mipi:
      return unpack_row<PixelFormat::mono12_mipi>;
    case PixelFormat::mono10_pfnc:
      return unpack_row<PixelFormat::mono10_pfnc>;
    case PixelFormat::mono12_pfnc:
      return unpack_row<PixelFormat::mono12_pfnc>;
    case PixelFormat::mono12_gev:
      return unpack_row<PixelFormat::mono12_gev>;
    case PixelFormat::mono8:
    case PixelFormat::rgb8:
    case PixelFormat::bgr8:
    case PixelFormat::mono16:
      break;
  }
  return unpack_row<PixelFormat::mono16>;
}

cv::Mat luminance(const PixelLayout& layout, const std::uint8_t* pixels, std::size_t stride) {
  const cv::Mat colour(layout.height_px, layout.width_px, CV_8UC3, const_cast<std::uint8_t*>(pixels), stride);
  cv::Mat grey;
  cv::cvtColor(colour, grey, layout.format == PixelFormat::rgb8 ? cv::COLOR_RGB2GRAY : cv::COLOR_BGR2GRAY);
  return grey;
}

}  // namespace

std::string_view name_of(PixelFormat format) { return entry_of(format).name; }

Result<PixelFormat> pixel_format_from_name(std::string_view name) {
  const auto* const found = std::ranges::find(kPixelFormats, name, &FormatName::name);
  if (found != kPixelFormats.end()) return found->format;
  std::string names;
  for (const FormatName& entry : kPixelFormats) names += (names.empty() ? "" : ", ") + std::string(entry.name);
  return invalid_input("pixel format \"{}\": expected one of {}", name, names);
}

std::size_t row_bytes(PixelFormat format, int width_px) {
  const auto width = static_cast<std::size_t>(std::max(width_px, 0));
  switch (format) {
    case PixelFormat::mono8:
      return width;
    case PixelFormat::mono10_mipi:  // whole groups
      return (width + 3) / 4 * 5;
    case PixelFormat::mono12_mipi:
    case PixelFormat::mono12_gev:
      return (width + 1) / 2 * 3;
    case PixelFormat::mono10_pfnc:  // to the next byte
      return (10 * width + 7) / 8;
    case PixelFormat::mono12_pfnc:
      return (12 * width + 7) / 8;
    case PixelFormat::rgb8:
    case PixelFormat::bgr8:
      return 3 * width;
    case PixelFormat::mono10:
    case PixelFormat::mono12:
    case PixelFormat::mono16:
      break;
  }
  return 2 * width;
}

Result<cv::Mat> unpack(const PixelLayout& layout, std::span<const std::uint8_t> buffer) {
  const std::size_t row = row_bytes(layout.format, layout.width_px);
  const std::size_t stride = layout.stride_bytes == 0 ? row : layout.stride_bytes;
  if (layout.width_px < 1 || layout.height_px < 1 || stride < row)
    return job_failed("a picture of {} x {} px in rows of {} bytes", layout.width_px, layout.height_px, stride);
  const auto height = static_cast<std::size_t>(layout.height_px);
  const std::size_t needed = (height - 1) * stride + row;
  if (buffer.size() < needed)
    return job_failed("{} bytes came, {} x {} px {} take {}", buffer.size(), layout.width_px, layout.height_px,
                      name_of(layout.format), needed);
  if (layout.format == PixelFormat::rgb8 || layout.format == PixelFormat::bgr8)
    return luminance(layout, buffer.data(), stride);
  cv::Mat image(layout.height_px, layout.width_px, layout.format == PixelFormat::mono8 ? CV_8UC1 : CV_16UC1);
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t* from = buffer.data() + y * stride;
    auto* to = image.ptr(static_cast<int>(y));
    if (layout.format == PixelFormat::mono8) {
      std::memcpy(to, from, row);
    } else {
      row_unpacker(layout.format)(from, reinterpret_cast<std::uint16_t*>(to), layout.width_px);
    }
  }
  return image;
}

}  // namespace imprint
