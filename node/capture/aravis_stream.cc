#include "node/capture/aravis_stream.h"

#include <arv.h>

#include <array>
#include <atomic>
#include <mutex>
#include <string>
#include <utility>

namespace imprint {
namespace {

constexpr std::uint64_t kIds16 = 65'535;                          // of GigE Vision 1: 1 to 65535, then 1 again
constexpr auto kPacketTimeout = std::chrono::milliseconds(20);    // then a packet is asked for again
constexpr auto kFrameRetention = std::chrono::milliseconds(200);  // then a frame is given up

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class Object>
using Owned = std::unique_ptr<Object, Unref>;

// Aravis' way to tell what is wrong, as an error of ours.
class Fault {
 public:
  Fault() = default;
  Fault(const Fault&) = delete;
  Fault& operator=(const Fault&) = delete;
  ~Fault() { g_clear_error(&error_); }

  GError** out() { return &error_; }
  explicit operator bool() const { return error_ != nullptr; }
  [[nodiscard]] const char* text() const { return error_ != nullptr ? error_->message : "no reason given"; }

 private:
  GError* error_ = nullptr;
};

struct FeatureFormat {
  PixelFormat format;
  const char* name;  // of the Pixel Format Naming Convention
  ArvPixelFormat code;
};
constexpr auto kFeatureFormats = std::to_array<FeatureFormat>({
    {PixelFormat::mono8, "Mono8", ARV_PIXEL_FORMAT_MONO_8},
    {PixelFormat::mono10, "Mono10", ARV_PIXEL_FORMAT_MONO_10},
    {PixelFormat::mono12, "Mono12", ARV_PIXEL_FORMAT_MONO_12},
    {PixelFormat::mono16, "Mono16", ARV_PIXEL_FORMAT_MONO_16},
    {PixelFormat::mono10_pfnc, "Mono10p", 0x010A0046},
    {PixelFormat::mono12_pfnc, "Mono12p", 0x010C0047},
    {PixelFormat::mono12_gev, "Mono12Packed", ARV_PIXEL_FORMAT_MONO_12_PACKED},
});

// Sets a feature of any type by its GenICam name.
Result<void> set_feature(ArvDevice* device, const CameraControl& control) {
  Fault fault;
  arv_device_set_features_from_string(device, (control.name + "=" + control.value).c_str(), fault.out());
  if (fault) return job_failed("camera.controls: {} = {}: {}", control.name, control.value, fault.text());
  return {};
}

class AravisStream final : public CameraStream {
 public:
  AravisStream(CameraSettings settings, Owned<ArvCamera> camera)
      : settings_(std::move(settings)), camera_(std::move(camera)), device_(arv_camera_get_device(camera_.get())) {}
  AravisStream(const AravisStream&) = delete;
  AravisStream& operator=(const AravisStream&) = delete;

  ~AravisStream() override {
    if (running_) arv_camera_stop_acquisition(camera_.get(), nullptr);
  }

  Result<void> start() {
    for (auto step : {&AravisStream::set_format, &AravisStream::set_trigger, &AravisStream::set_start_exposure,
                      &AravisStream::set_controls, &AravisStream::begin})
      if (auto done = (this->*step)(); !done) return job_failed("{}: {}", settings_.device, done.error().message);
    return {};
  }

  Result<std::optional<RawFrame>> next(std::chrono::milliseconds timeout) override {
    ArvBuffer* popped =
        arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(std::chrono::microseconds(timeout).count()));
    if (popped == nullptr) {
      if (lost_) return job_failed("{}: lost: its control link does not answer", settings_.device);
      return std::nullopt;
    }
    return frame_of(popped);
  }

  Result<void> set_exposure(const Exposure& wanted) override {
    const std::lock_guard lock(mutex_);
    Fault fault;
    arv_camera_set_exposure_time(camera_.get(), wanted.time_us, fault.out());
    if (fault) return job_failed("{}: exposure {:g} us: {}", settings_.device, wanted.time_us, fault.text());
    if (wanted.gain_db != exposure_.gain_db || exposure_.time_us == 0.0) {
      arv_camera_set_gain(camera_.get(), wanted.gain_db, fault.out());
      if (fault && wanted.gain_db != 0.0)
        return job_failed("{}: gain {:g} dB: {}", settings_.device, wanted.gain_db, fault.text());
    }
    read_exposure();
    return {};
  }

  [[nodiscard]] Exposure exposure() const override {
    const std::lock_guard lock(mutex_);
    return exposure_;
  }

  Result<void> fire() override {
    Fault fault;
    arv_camera_software_trigger(camera_.get(), fault.out());
    if (fault) return job_failed("{}: does not take a trigger: {}", settings_.device, fault.text());
    return {};
  }

 private:
  Result<void> set_format() {
    for (const FeatureFormat& entry : kFeatureFormats) {
      if (entry.format != settings_.format) continue;
      Fault fault;
      arv_camera_set_pixel_format(camera_.get(), entry.code, fault.out());
      if (fault) return job_failed("camera.format: {}: {}", entry.name, fault.text());
      return set_size();
    }
    return job_failed("camera.format: GenICam has no {}", name_of(settings_.format));
  }

  Result<void> set_size() {
    Fault fault;
    if (settings_.width_px != 0) {
      arv_camera_set_region(camera_.get(), 0, 0, settings_.width_px, settings_.height_px, fault.out());
      if (fault) return job_failed("camera.width_px, height_px: {}", fault.text());
    }
    gint x = 0;
    gint y = 0;
    gint width = 0;
    gint height = 0;
    arv_camera_get_region(camera_.get(), &x, &y, &width, &height, fault.out());
    if (fault) return job_failed("its region cannot be read: {}", fault.text());
    if (settings_.width_px != 0 && (width != settings_.width_px || height != settings_.height_px))
      return job_failed("camera.width_px, height_px: expected {} x {} px, the camera gives {} x {} px",
                        settings_.width_px, settings_.height_px, width, height);
    layout_ = {settings_.format, width, height, 0};
    return {};
  }

  Result<void> set_trigger() {
    Fault fault;
    switch (settings_.trigger) {
      case CameraTrigger::free_running:
        arv_camera_clear_triggers(camera_.get(), fault.out());
        if (!fault && settings_.frames_per_s > 0.0)
          arv_camera_set_frame_rate(camera_.get(), settings_.frames_per_s, fault.out());
        break;
      case CameraTrigger::software:
        arv_camera_set_trigger(camera_.get(), "Software", fault.out());
        break;
      case CameraTrigger::hardware:
        arv_camera_set_trigger(camera_.get(), "Line1", fault.out());
        break;
    }
    if (fault) return job_failed("camera.trigger, frames_per_s: {}", fault.text());
    arv_camera_set_acquisition_mode(camera_.get(), ARV_ACQUISITION_MODE_CONTINUOUS, fault.out());
    if (fault) return job_failed("AcquisitionMode: {}", fault.text());
    return {};
  }

  Result<void> set_start_exposure() {
    if (settings_.exposure.time_us > 0.0) return set_exposure(settings_.exposure);
    const std::lock_guard lock(mutex_);
    read_exposure();
    return {};
  }

  Result<void> set_controls() {
    for (const CameraControl& control : settings_.controls)
      if (auto set = set_feature(device_, control); !set) return set;
    return {};
  }

  Result<void> begin() {
    Fault fault;
    if (arv_camera_is_gv_device(camera_.get()) != 0) {
      if (settings_.packet_bytes != 0)
        arv_camera_gv_set_packet_size(camera_.get(), settings_.packet_bytes, fault.out());
      if (fault) return job_failed("camera.packet_bytes: {}", fault.text());
      // A raw socket would need privileges that the node does not have.
      arv_camera_gv_set_stream_options(camera_.get(), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
    }
    const guint payload = arv_camera_get_payload(camera_.get(), fault.out());
    if (fault) return job_failed("PayloadSize: {}", fault.text());
    if (ArvStream* made = arv_camera_create_stream(camera_.get(), nullptr, nullptr, fault.out())) {
      stream_ = {made, Unref{}};
    } else {
      return job_failed("no stream: {}", fault.text());
    }
    if (ARV_IS_GV_STREAM(stream_.get())) {
      g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                   static_cast<gint>(1e6 * settings_.socket_buffer_mb), "packet-resend",
                   ARV_GV_STREAM_PACKET_RESEND_ALWAYS, "packet-timeout",
                   static_cast<guint>(std::chrono::microseconds(kPacketTimeout).count()), "frame-retention",
                   static_cast<guint>(std::chrono::microseconds(kFrameRetention).count()), nullptr);
    }
    for (int i = 0; i < settings_.buffers; ++i) arv_stream_push_buffer(stream_.get(), arv_buffer_new(payload, nullptr));
    g_signal_connect(device_, "control-lost", G_CALLBACK(+[](ArvDevice*, std::atomic<bool>* lost) { *lost = true; }),
                     &lost_);
    arv_camera_start_acquisition(camera_.get(), fault.out());
    if (fault) return job_failed("cannot be started: {}", fault.text());
    running_ = true;
    return {};
  }

  // As the camera rounded it; with the lock held.
  void read_exposure() {
    Fault no_time;
    Fault no_gain;
    exposure_.time_us = arv_camera_get_exposure_time(camera_.get(), no_time.out());
    exposure_.gain_db = arv_camera_get_gain(camera_.get(), no_gain.out());
    if (no_time) exposure_.time_us = 0.0;
    if (no_gain) exposure_.gain_db = 0.0;
  }

  RawFrame frame_of(ArvBuffer* popped) {
    RawFrame frame;
    frame.layout = layout_;
    frame.sequence = arv_buffer_get_frame_id(popped);
    frame.sensor_time_ns = static_cast<std::int64_t>(arv_buffer_get_system_timestamp(popped));
    const ArvBufferStatus status = arv_buffer_get_status(popped);
    frame.damaged = status != ARV_BUFFER_STATUS_SUCCESS;
    const bool counted = status != ARV_BUFFER_STATUS_CLEARED && status != ARV_BUFFER_STATUS_UNKNOWN;
    if (counted && last_id_) frame.missed = missed_between(*last_id_, frame.sequence);
    if (counted) last_id_ = frame.sequence;
    frame.exposure = exposure();
    std::size_t size = 0;
    const auto* bytes = static_cast<const std::uint8_t*>(arv_buffer_get_data(popped, &size));
    frame.bytes = {bytes, size};
    // A frame that is out keeps the stream alive, to which its buffer goes back.
    frame.buffer = std::shared_ptr<const void>(
        bytes, [stream = stream_, popped](const void*) { arv_stream_push_buffer(stream.get(), popped); });
    return frame;
  }

  const CameraSettings settings_;
  const Owned<ArvCamera> camera_;
  ArvDevice* const device_;  // the camera's
  std::shared_ptr<ArvStream> stream_;
  PixelLayout layout_;
  bool running_ = false;
  std::atomic<bool> lost_ = false;
  std::optional<std::uint64_t> last_id_;
  mutable std::mutex mutex_;  // guards the exposure and its features
  Exposure exposure_;
};

}  // namespace

std::uint64_t missed_between(std::uint64_t last, std::uint64_t next) {
  if (next > last) return next - last - 1;
  if (last <= kIds16 && next != 0 && last - next > kIds16 / 2) return next + kIds16 - last - 1;
  return 0;  // counted back: the camera began anew
}

Result<std::unique_ptr<CameraStream>> open_aravis_stream(const CameraSettings& settings) {
  const std::string name = settings.device.empty() ? "the first camera found" : settings.device;
  Fault fault;
  Owned<ArvCamera> camera(arv_camera_new(settings.device.empty() ? nullptr : settings.device.c_str(), fault.out()));
  if (!camera) return job_failed("{}: no such camera: {}", name, fault.text());
  auto stream = std::make_unique<AravisStream>(settings, std::move(camera));
  if (auto started = stream->start(); !started) return pass_on(started.error());
  return stream;
}

}  // namespace imprint
