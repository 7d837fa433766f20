#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "lib/result/result.h"
#include "node/capture/exposure.h"
#include "node/capture/pixel_format.h"

namespace imprint {

/// What makes a camera take a picture.
enum class CameraTrigger {
  free_running,  ///< it takes one after the other; a trigger is served with the one of its moment
  software,      ///< our command at the trigger's moment
  hardware,      ///< a line into the camera; a trigger is served with the frame of its moment
};
inline constexpr auto kCameraTriggers = std::to_array<std::string_view>({"free", "software", "hardware"});

/// `name=value` of the camera's own settings.
struct CameraControl {
  std::string name;
  std::string value;
};

/// Of a camera's buffers those that cannot keep a recent frame: one being filled, one next.
inline constexpr int kBuffersOfTheDriver = 2;

/// How a camera is to be set; `[camera]` of node.toml.
struct CameraSettings {
  std::string device;  // v4l2: a path; aravis, libcamera: its id; empty: the only one there is
  int width_px = 0;    // 0: as the camera is set
  int height_px = 0;   // likewise
  PixelFormat format = PixelFormat::mono8;
  int input = -1;             // v4l2: of a device with several; -1: as it is set
  double frames_per_s = 0.0;  // 0: as the camera is set
  CameraTrigger trigger = CameraTrigger::free_running;
  int buffers = 4;        // the camera's own; of 16 MB each at 16 megapixels and 8 bit
  int recent_frames = 2;  // of the buffers, kept for triggers in the near past
  Exposure exposure{};    // to start with; 0: as the camera is set
  std::string exposure_control = "exposure_time_absolute";  // v4l2: its name
  double exposure_unit_us = 100.0;                          // v4l2: of that control; UVC's is 100
  std::string gain_control = "gain";                        // v4l2: its name
  double gain_unit_db = 0.0;                                // v4l2: of that control; 0: not known, the gain is not set
  std::vector<CameraControl> controls{};                    // set when the camera is opened, in this order
  double stall_s = 3.0;            // a running camera without a frame for so long is opened anew
  int packet_bytes = 0;            // aravis: 0: as the camera is set
  double socket_buffer_mb = 64.0;  // aravis: net.core.rmem_max must allow it

  /// Names the key of `[camera]` that is out of its range.
  [[nodiscard]] Result<void> validate() const;
};

/// From "name=value". Fails (invalid_input) on anything else.
Result<CameraControl> camera_control_from_text(std::string_view text);

}  // namespace imprint
