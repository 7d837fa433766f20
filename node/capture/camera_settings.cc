#include "node/capture/camera_settings.h"

namespace imprint {
namespace {

constexpr int kMaxSide = 65'535;

}  // namespace

Result<void> CameraSettings::validate() const {
  const auto side_fits = [](int side) { return side >= 0 && side <= kMaxSide; };
  if (!side_fits(width_px) || !side_fits(height_px))
    return invalid_input("width_px, height_px: expected 0 to {}, found {} and {}", kMaxSide, width_px, height_px);
  if ((width_px == 0) != (height_px == 0))
    return invalid_input("width_px, height_px: expected both or neither, found {} and {}", width_px, height_px);
  if (!(frames_per_s >= 0.0 && frames_per_s <= 1000.0))
    return invalid_input("frames_per_s: expected 0 to 1000, found {}", frames_per_s);
  if (buffers < kBuffersOfTheDriver + 1 || buffers > 32)
    return invalid_input("buffers: expected 3 to 32, found {}", buffers);
  if (recent_frames < 1 || recent_frames > buffers - kBuffersOfTheDriver)
    return invalid_input("recent_frames: expected 1 to {}, for the camera needs {} of its {} buffers; found {}",
                         buffers - kBuffersOfTheDriver, kBuffersOfTheDriver, buffers, recent_frames);
  if (!(exposure.time_us >= 0.0 && exposure.time_us <= 1e7))
    return invalid_input("exposure_us: expected 0 to 1e7, found {}", exposure.time_us);
  if (!(exposure.gain_db >= 0.0 && exposure.gain_db <= 60.0))
    return invalid_input("gain_db: expected 0 to 60, found {}", exposure.gain_db);
  if (!(exposure_unit_us > 0.0 && exposure_unit_us <= 1e6))
    return invalid_input("exposure_unit_us: expected more than 0 to 1e6, found {}", exposure_unit_us);
  if (!(gain_unit_db >= 0.0 && gain_unit_db <= 10.0))
    return invalid_input("gain_unit_db: expected 0 to 10, found {}", gain_unit_db);
  if (!(stall_s >= 0.1 && stall_s <= 3600.0)) return invalid_input("stall_s: expected 0.1 to 3600, found {}", stall_s);
  if (packet_bytes != 0 && (packet_bytes < 576 || packet_bytes > 16'000))
    return invalid_input("packet_bytes: expected 0 or 576 to 16000, found {}", packet_bytes);
  if (!(socket_buffer_mb >= 0.1 && socket_buffer_mb <= 1024.0))
    return invalid_input("socket_buffer_mb: expected 0.1 to 1024, found {}", socket_buffer_mb);
  return {};
}

Result<CameraControl> camera_control_from_text(std::string_view text) {
  const auto equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0 || equals + 1 == text.size())
    return invalid_input("expected name=value, found \"{}\"", text);
  return CameraControl{std::string(text.substr(0, equals)), std::string(text.substr(equals + 1))};
}

}  // namespace imprint
