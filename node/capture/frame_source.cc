#include "node/capture/frame_source.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "node/capture/file_source.h"
#include "node/capture/live_source.h"
#include "node/capture/simulation_source.h"
#include "node/capture/v4l2_stream.h"
#ifdef IMPRINT_ARAVIS
#include "node/capture/aravis_stream.h"
#endif
#ifdef IMPRINT_LIBCAMERA
#include "node/capture/libcamera_stream.h"
#endif

namespace imprint {
namespace {

using OpenCamera = Result<std::unique_ptr<CameraStream>> (*)(const CameraSettings&);

struct Driver {
  std::string_view name;
  OpenCamera open;
};

constexpr auto kDrivers = std::to_array<Driver>({
    {"v4l2", [](const CameraSettings& settings) { return open_v4l2_stream(settings); }},
#ifdef IMPRINT_ARAVIS
    {"aravis", [](const CameraSettings& settings) { return open_aravis_stream(settings); }},
#endif
#ifdef IMPRINT_LIBCAMERA
    {"libcamera", [](const CameraSettings& settings) { return open_libcamera_stream(settings); }},
#endif
});

constexpr auto kDriverNames = [] {
  std::array<std::string_view, kDrivers.size()> names{};
  std::ranges::transform(kDrivers, names.begin(), &Driver::name);
  return names;
}();

LiveConfig live_config(const CameraSettings& settings) {
  LiveConfig config;
  config.trigger = settings.trigger;
  config.recent_frames = static_cast<std::size_t>(settings.recent_frames);
  config.stall = std::chrono::milliseconds(std::llround(1000.0 * settings.stall_s));
  config.exposure = settings.exposure;
  return config;
}

}  // namespace

std::span<const std::string_view> camera_sources() { return kDriverNames; }

Result<std::unique_ptr<FrameSource>> open_camera_source(std::string_view source, const CameraSettings& settings,
                                                        const std::string& camera_id) {
  const auto* const driver = std::ranges::find(kDrivers, source, &Driver::name);
  if (driver == kDrivers.end()) return invalid_input("frame source \"{}\": this program was built without it", source);
  if (const auto valid = settings.validate(); !valid) return invalid_input("camera.{}", valid.error().message);
  const auto open = [settings, driver](const Exposure& exposure) {
    CameraSettings now = settings;
    if (exposure.time_us > 0.0) now.exposure = exposure;
    return driver->open(now);
  };
  const std::string device = settings.device.empty() ? std::string(source) : settings.device;
  return std::make_unique<LiveSource>(fmt::format("camera \"{}\" ({})", camera_id, device), open,
                                      live_config(settings));
}

Result<std::unique_ptr<FrameSource>> open_frame_source(std::string_view source, const std::filesystem::path& path,
                                                       const std::string& camera_id) {
  if (source == "folder") return open_folder_source(path, camera_id);
  if (source == "session") return open_session_source(path, camera_id);
  if (source == "simulation") return open_simulation_source(path, camera_id);
  return invalid_input("frame source \"{}\": expected folder, session or simulation", source);
}

}  // namespace imprint
