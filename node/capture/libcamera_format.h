#pragma once

#include <span>
#include <string>

#include <libcamera/controls.h>
#include <libcamera/framebuffer.h>
#include <libcamera/pixel_format.h>

#include "lib/result/result.h"
#include "node/capture/exposure.h"
#include "node/capture/pixel_format.h"

namespace imprint {

/// One of libcamera's formats, and how it lies in memory.
struct LibcameraFormat {
  libcamera::PixelFormat code;
  PixelFormat layout = PixelFormat::mono8;
};

/// The best of the offered formats for `camera.format`: for mono8 grey, else a plane of luminance, else colour of which
/// the luminance is taken; for the others exactly that. Fails (job_failed) listing what is offered.
Result<LibcameraFormat> choose_libcamera_format(PixelFormat wanted, std::span<const libcamera::PixelFormat> offered);

/// The text as a value of the control's type: whole and decimal numbers, true and false. Fails (invalid_input) naming
/// what was expected.
Result<libcamera::ControlValue> libcamera_control_value(const libcamera::ControlId& id, const std::string& text);

/// libcamera's gain is a factor.
double gain_factor(double gain_db);
double gain_db(double factor);

/// Whether it is a picture of the camera's, be it damaged: not one that was cancelled, nor one taken while the camera
/// settles, which newer versions hand over (FrameStartup) and older ones kept back.
bool is_picture(libcamera::FrameMetadata::Status status);

/// What the camera says of the exposure of a frame; what it does not say is that of `asked`.
Exposure exposure_of(const libcamera::ControlList& metadata, const Exposure& asked);

}  // namespace imprint
