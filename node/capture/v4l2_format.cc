#include "node/capture/v4l2_format.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

namespace imprint {
namespace {

struct Code {
  std::uint32_t fourcc;
  PixelFormat format;
};

// Best first. Of the formats with colour the plane of luminance, which comes first in memory.
constexpr auto kCodes = std::to_array<Code>({
    {V4L2_PIX_FMT_GREY, PixelFormat::mono8},
    {V4L2_PIX_FMT_NV12, PixelFormat::mono8},
    {V4L2_PIX_FMT_YUV420, PixelFormat::mono8},
    {V4L2_PIX_FMT_Y10, PixelFormat::mono10},
    {V4L2_PIX_FMT_Y12, PixelFormat::mono12},
    {V4L2_PIX_FMT_Y16, PixelFormat::mono16},
    {V4L2_PIX_FMT_Y10P, PixelFormat::mono10_mipi},
    {v4l2_fourcc('Y', '1', '2', 'P'), PixelFormat::mono12_mipi},
});

std::string text_of(std::uint32_t fourcc) {
  std::string text;
  for (unsigned shift = 0; shift < 32; shift += 8) {
    const char letter = static_cast<char>(fourcc >> shift & 0x7FU);
    if (letter > ' ') text += letter;
  }
  return text;
}

std::vector<std::uint32_t> offered(V4l2Device& device, V4l2Planes planes) {
  std::vector<std::uint32_t> codes;
  v4l2_fmtdesc description{};
  description.type = buffer_type(planes);
  while (codes.size() < 256 && device.call(VIDIOC_ENUM_FMT, &description) == 0) {
    codes.push_back(description.pixelformat);
    ++description.index;
  }
  return codes;
}

Result<std::uint32_t> fourcc_of(V4l2Device& device, V4l2Planes planes, PixelFormat format) {
  const std::vector<std::uint32_t> codes = offered(device, planes);
  std::string names;
  for (const Code& code : kCodes) {
    if (std::ranges::find(codes, code.fourcc) == codes.end()) continue;
    if (code.format == format) return code.fourcc;
    names += fmt::format("{}{} ({})", names.empty() ? "" : ", ", name_of(code.format), text_of(code.fourcc));
  }
  return job_failed("camera.format: the camera does not give {}, but {}", name_of(format),
                    names.empty() ? "none that is known" : names);
}

Result<void> set_rate(V4l2Device& device, V4l2Planes planes, double frames_per_s) {
  if (frames_per_s == 0.0) return {};
  v4l2_streamparm parameters{};
  parameters.type = buffer_type(planes);
  parameters.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(1000.0 * frames_per_s))};
  if (const int fault = device.call(VIDIOC_S_PARM, &parameters))
    return job_failed("camera.frames_per_s: the camera's rate cannot be set: {}", std::strerror(fault));
  return {};
}

void write_size(v4l2_format& format, V4l2Planes planes, std::uint32_t fourcc, const CameraSettings& settings) {
  const auto width = static_cast<std::uint32_t>(settings.width_px);
  const auto height = static_cast<std::uint32_t>(settings.height_px);
  const auto write = [&](auto& pixels) {
    pixels.pixelformat = fourcc;
    if (width != 0) pixels.width = width;
    if (height != 0) pixels.height = height;
    pixels.field = V4L2_FIELD_NONE;
  };
  if (planes == V4l2Planes::multi) {
    write(format.fmt.pix_mp);
    format.fmt.pix_mp.num_planes = 1;
    format.fmt.pix_mp.plane_fmt[0] = {};  // the driver knows what a row of the new width takes
  } else {
    write(format.fmt.pix);
    format.fmt.pix.bytesperline = 0;
    format.fmt.pix.sizeimage = 0;
  }
}

}  // namespace

Result<V4l2Planes> v4l2_planes(V4l2Device& device) {
  v4l2_capability capability{};
  if (const int fault = device.call(VIDIOC_QUERYCAP, &capability)) return job_failed("{}", std::strerror(fault));
  const std::uint32_t can =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0U ? capability.device_caps : capability.capabilities;
  if ((can & V4L2_CAP_STREAMING) == 0U) return job_failed("this device does not stream");
  if ((can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0U) return V4l2Planes::multi;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) != 0U) return V4l2Planes::single;
  return job_failed("this device does not capture pictures");
}

Result<PixelLayout> set_v4l2_format(V4l2Device& device, V4l2Planes planes, const CameraSettings& settings) {
  if (int input = settings.input; input >= 0) {
    if (const int fault = device.call(VIDIOC_S_INPUT, &input))
      return job_failed("camera.input: no input {}: {}", input, std::strerror(fault));
  }
  const auto fourcc = fourcc_of(device, planes, settings.format);
  if (!fourcc) return pass_on(fourcc.error());
  v4l2_format format{};
  format.type = buffer_type(planes);
  if (const int fault = device.call(VIDIOC_G_FMT, &format))
    return job_failed("its format cannot be read: {}", std::strerror(fault));
  write_size(format, planes, *fourcc, settings);
  if (const int fault = device.call(VIDIOC_S_FMT, &format))
    return job_failed("its format cannot be set: {}", std::strerror(fault));
  if (auto rate = set_rate(device, planes, settings.frames_per_s); !rate) return pass_on(rate.error());

  const auto given = [&](const auto& pixels, std::uint32_t stride) -> Result<PixelLayout> {
    const PixelLayout layout{settings.format, static_cast<int>(pixels.width), static_cast<int>(pixels.height), stride};
    const bool as_wanted =
        pixels.pixelformat == *fourcc &&
        (settings.width_px == 0 || (layout.width_px == settings.width_px && layout.height_px == settings.height_px));
    if (as_wanted) return layout;
    return job_failed("camera.width_px, height_px: expected {} x {} px {}, the camera gives {} x {} px {}",
                      settings.width_px, settings.height_px, text_of(*fourcc), layout.width_px, layout.height_px,
                      text_of(pixels.pixelformat));
  };
  return planes == V4l2Planes::multi ? given(format.fmt.pix_mp, format.fmt.pix_mp.plane_fmt[0].bytesperline)
                                     : given(format.fmt.pix, format.fmt.pix.bytesperline);
}

}  // namespace imprint
