#include "node/capture/libcamera_format.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include <libcamera/control_ids.h>

namespace imprint {
namespace {

constexpr std::uint32_t fourcc(const char (&text)[5]) {
  std::uint32_t code = 0;
  for (unsigned i = 0; i < 4; ++i) code |= static_cast<std::uint32_t>(static_cast<unsigned char>(text[i])) << 8U * i;
  return code;
}

constexpr std::uint64_t kMipiPacked = 11ULL << 56U | 1U;  // MIPI_FORMAT_MOD_CSI2_PACKED of drm_fourcc.h

struct Code {
  std::uint32_t fourcc;
  std::uint64_t modifier;
  PixelFormat wanted;
  PixelFormat layout;
};

// Best first. By DRM's codes, as each version of libcamera names a part of them only; of the formats with planes that
// of luminance comes first in memory. DRM names colours from the highest byte: RG24 lies as blue, green, red.
constexpr auto kCodes = std::to_array<Code>({
    {fourcc("R8  "), 0, PixelFormat::mono8, PixelFormat::mono8},
    {fourcc("NV12"), 0, PixelFormat::mono8, PixelFormat::mono8},
    {fourcc("NV21"), 0, PixelFormat::mono8, PixelFormat::mono8},
    {fourcc("YU12"), 0, PixelFormat::mono8, PixelFormat::mono8},
    {fourcc("YV12"), 0, PixelFormat::mono8, PixelFormat::mono8},
    {fourcc("RG24"), 0, PixelFormat::mono8, PixelFormat::bgr8},
    {fourcc("BG24"), 0, PixelFormat::mono8, PixelFormat::rgb8},
    {fourcc("R10 "), 0, PixelFormat::mono10, PixelFormat::mono10},
    {fourcc("R12 "), 0, PixelFormat::mono12, PixelFormat::mono12},
    {fourcc("R16 "), 0, PixelFormat::mono16, PixelFormat::mono16},
    {fourcc("R10 "), kMipiPacked, PixelFormat::mono10_mipi, PixelFormat::mono10_mipi},
    {fourcc("R12 "), kMipiPacked, PixelFormat::mono12_mipi, PixelFormat::mono12_mipi},
});

template <class Number>
std::optional<Number> number(const std::string& text) {
  Number value{};
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

template <class Number>
Result<libcamera::ControlValue> number_value(const libcamera::ControlId& id, const std::string& text,
                                             std::string_view kind) {
  if (const auto value = number<Number>(text)) return libcamera::ControlValue(*value);
  return invalid_input("{}: expected {}, found \"{}\"", id.name(), kind, text);
}

}  // namespace

Result<LibcameraFormat> choose_libcamera_format(PixelFormat wanted, std::span<const libcamera::PixelFormat> offered) {
  for (const Code& code : kCodes) {
    const libcamera::PixelFormat format(code.fourcc, code.modifier);
    if (code.wanted == wanted && std::ranges::find(offered, format) != offered.end())
      return LibcameraFormat{format, code.layout};
  }
  std::string names;
  for (const libcamera::PixelFormat& format : offered) names += (names.empty() ? "" : ", ") + format.toString();
  return job_failed("camera.format: the camera does not give {}, but {}", name_of(wanted),
                    names.empty() ? "nothing" : names);
}

Result<libcamera::ControlValue> libcamera_control_value(const libcamera::ControlId& id, const std::string& text) {
  switch (id.type()) {
    case libcamera::ControlTypeBool:
      if (text == "true" || text == "1") return libcamera::ControlValue(true);
      if (text == "false" || text == "0") return libcamera::ControlValue(false);
      return invalid_input("{}: expected true or false, found \"{}\"", id.name(), text);
    case libcamera::ControlTypeInteger32:
      return number_value<std::int32_t>(id, text, "a whole number");
    case libcamera::ControlTypeInteger64:
      return number_value<std::int64_t>(id, text, "a whole number");
    case libcamera::ControlTypeFloat:
      return number_value<float>(id, text, "a number");
    default:
      return invalid_input("{}: only a switch or a number can be set", id.name());
  }
}

double gain_factor(double gain_db) { return std::pow(10.0, gain_db / 20.0); }

double gain_db(double factor) { return factor > 0.0 ? 20.0 * std::log10(factor) : 0.0; }

bool is_picture(libcamera::FrameMetadata::Status status) {
  constexpr int kStartup = 3;  // FrameStartup, which older headers do not name
  return status != libcamera::FrameMetadata::FrameCancelled && static_cast<int>(status) != kStartup;
}

Exposure exposure_of(const libcamera::ControlList& metadata, const Exposure& asked) {
  Exposure exposure = asked;
  if (const auto time_us = metadata.get(libcamera::controls::ExposureTime)) exposure.time_us = *time_us;
  if (const auto factor = metadata.get(libcamera::controls::AnalogueGain))
    exposure.gain_db = gain_db(static_cast<double>(*factor));
  return exposure;
}

}  // namespace imprint
