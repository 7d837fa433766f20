#include "node/capture/libcamera_stream.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include <libcamera/camera_manager.h>
#include <libcamera/control_ids.h>

#include "node/capture/libcamera_format.h"
#include "node/capture/libcamera_queue.h"

namespace imprint {
namespace {

namespace controls = libcamera::controls;

// libcamera allows one manager in a process, which looks for cameras when it starts: made anew unless in use.
class Manager {
 public:
  Manager() {
    const std::lock_guard lock(mutex_);
    if (users_++ > 0) return;
    manager_ = std::make_unique<libcamera::CameraManager>();
    fault_ = manager_->start();
  }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;
  ~Manager() {
    const std::lock_guard lock(mutex_);
    if (--users_ > 0) return;
    if (fault_ == 0) manager_->stop();
    manager_.reset();
  }

  Result<std::shared_ptr<libcamera::Camera>> find(const std::string& id) const {
    const std::lock_guard lock(mutex_);
    if (fault_ != 0) return job_failed("libcamera does not start: {}", std::strerror(-fault_));
    std::string ids;
    std::shared_ptr<libcamera::Camera> only;
    const auto cameras = manager_->cameras();
    for (const auto& camera : cameras) {
      if (camera->id() == id) return camera;
      ids += (ids.empty() ? "" : ", ") + camera->id();
      only = camera;
    }
    if (id.empty() && cameras.size() == 1) return only;
    return job_failed("no such camera: camera.device: expected one of libcamera's ids, which are: {}",
                      ids.empty() ? "none" : ids);
  }

 private:
  static inline std::mutex mutex_;
  static inline int users_ = 0;
  static inline int fault_ = 0;
  static inline std::unique_ptr<libcamera::CameraManager> manager_;
};

class LibcameraStream final : public CameraStream {
 public:
  LibcameraStream(std::string name, CameraSettings settings) : name_(std::move(name)), settings_(std::move(settings)) {}
  LibcameraStream(const LibcameraStream&) = delete;
  LibcameraStream& operator=(const LibcameraStream&) = delete;

  ~LibcameraStream() override {
    if (queue_) queue_->stop();
    queue_.reset();
    if (acquired_) camera_->release();
  }

  Result<void> start() {
    auto camera = manager_.find(settings_.device);
    if (!camera) return pass_on(camera.error());
    camera_ = std::move(*camera);
    if (const int fault = camera_->acquire()) return job_failed("is in use by another: {}", std::strerror(-fault));
    acquired_ = true;
    if (auto set = configure(); !set) return set;
    libcamera::ControlList at_start;
    if (auto set = set_rate(at_start); !set) return set;
    if (settings_.exposure.time_us > 0.0)
      if (auto set = set_exposure(at_start, settings_.exposure); !set) return set;
    for (const CameraControl& control : settings_.controls)
      if (auto set = set_control(at_start, control); !set) return set;
    exposure_ = settings_.exposure;
    queue_ = std::make_shared<LibcameraQueue>(camera_);
    return queue_->start(config_->at(0).stream(),
                         static_cast<std::size_t>(settings_.recent_frames + kBuffersOfTheDriver), at_start, exposure_);
  }

  Result<std::optional<RawFrame>> next(std::chrono::milliseconds timeout) override {
    auto taken = queue_->next(timeout);
    if (!taken) return job_failed("{}: {}", name_, taken.error().message);
    if (!*taken) return std::nullopt;
    RawFrame frame = std::move((*taken)->frame);
    frame.layout = layout_;
    if (const auto counted = (*taken)->counted) {
      // 32 bits that may wrap.
      if (last_sequence_) frame.missed = *counted - *last_sequence_ - 1;
      if (frame.missed >= 1U << 31U) frame.missed = 0;  // counted back: a driver that began anew
      last_sequence_ = *counted;
    }
    const std::lock_guard lock(mutex_);
    exposure_ = frame.exposure;
    return frame;
  }

  Result<void> set_exposure(const Exposure& wanted) override {
    libcamera::ControlList changed;
    if (auto set = set_exposure(changed, wanted); !set) return job_failed("{}: {}", name_, set.error().message);
    queue_->set(changed, wanted);
    const std::lock_guard lock(mutex_);
    exposure_ = wanted;
    return {};
  }

  [[nodiscard]] Exposure exposure() const override {
    const std::lock_guard lock(mutex_);
    return exposure_;
  }

  Result<void> fire() override {
    return job_failed("{}: libcamera knows no trigger by software; camera.trigger: free or hardware", name_);
  }

 private:
  // The raw stream where that has the format: the sensor's own values; else what the camera makes of them.
  Result<void> configure() {
    std::vector<libcamera::PixelFormat> offered;
    for (const auto role : {libcamera::StreamRole::Raw, libcamera::StreamRole::StillCapture,
                            libcamera::StreamRole::VideoRecording, libcamera::StreamRole::Viewfinder}) {
      auto config = camera_->generateConfiguration({role});
      if (!config || config->empty()) continue;
      const auto formats = config->at(0).formats().pixelformats();
      if (const auto format = choose_libcamera_format(settings_.format, formats)) {
        config_ = std::move(config);
        return configure(*format);
      }
      for (const libcamera::PixelFormat& format : formats)
        if (std::find(offered.begin(), offered.end(), format) == offered.end()) offered.push_back(format);
    }
    return pass_on(choose_libcamera_format(settings_.format, offered).error());
  }

  Result<void> configure(const LibcameraFormat& format) {
    libcamera::StreamConfiguration& stream = config_->at(0);
    stream.pixelFormat = format.code;
    stream.bufferCount = static_cast<unsigned>(settings_.buffers);
    if (settings_.width_px != 0)
      stream.size = {static_cast<unsigned>(settings_.width_px), static_cast<unsigned>(settings_.height_px)};
    const libcamera::Size wanted = stream.size;
    if (config_->validate() == libcamera::CameraConfiguration::Invalid || stream.pixelFormat != format.code)
      return job_failed("camera.format: the camera offers {} and does not take it", format.code.toString());
    if (stream.size != wanted)
      return job_failed("camera.width_px, height_px: expected {} x {} px, the camera gives {} x {} px", wanted.width,
                        wanted.height, stream.size.width, stream.size.height);
    if (const int fault = camera_->configure(config_.get()))
      return job_failed("cannot be set to {}: {}", stream.toString(), std::strerror(-fault));
    layout_ = {format.layout, static_cast<int>(stream.size.width), static_cast<int>(stream.size.height), stream.stride};
    return {};
  }

  [[nodiscard]] bool has(const libcamera::ControlId& id) const {
    return camera_->controls().find(&id) != camera_->controls().end();
  }

  Result<void> set_rate(libcamera::ControlList& list) const {
    if (settings_.frames_per_s == 0.0) return {};
    if (!has(controls::FrameDurationLimits))
      return job_failed("camera.frames_per_s: the camera's rate cannot be set: expected 0");
    const std::int64_t duration_us = std::llround(1e6 / settings_.frames_per_s);
    list.set(controls::FrameDurationLimits, {duration_us, duration_us});
    return {};
  }

  Result<void> set_exposure(libcamera::ControlList& list, const Exposure& wanted) const {
    if (!has(controls::ExposureTime))
      return job_failed("exposure {:g} us: the camera's exposure cannot be set", wanted.time_us);
    if (has(controls::AeEnable)) list.set(controls::AeEnable, false);
    list.set(controls::ExposureTime, static_cast<std::int32_t>(std::lround(wanted.time_us)));
    if (has(controls::AnalogueGain)) {
      list.set(controls::AnalogueGain, static_cast<float>(gain_factor(wanted.gain_db)));
    } else if (wanted.gain_db != 0.0) {
      return job_failed("gain {:g} dB: the camera's gain cannot be set", wanted.gain_db);
    }
    return {};
  }

  Result<void> set_control(libcamera::ControlList& list, const CameraControl& control) const {
    std::string names;
    for (const auto& [id, info] : camera_->controls()) {
      if (id->name() != control.name) {
        names += (names.empty() ? "" : ", ") + id->name();
        continue;
      }
      const auto value = libcamera_control_value(*id, control.value);
      if (!value) return job_failed("camera.controls: {}", value.error().message);
      list.set(id->id(), *value);
      return {};
    }
    return job_failed("camera.controls: \"{}\": the camera has {}", control.name, names.empty() ? "none" : names);
  }

  const std::string name_;  // in messages
  const CameraSettings settings_;
  Manager manager_;  // ends last
  std::shared_ptr<libcamera::Camera> camera_;
  bool acquired_ = false;
  std::unique_ptr<libcamera::CameraConfiguration> config_;
  std::shared_ptr<LibcameraQueue> queue_;
  PixelLayout layout_;
  std::optional<std::uint32_t> last_sequence_;
  mutable std::mutex mutex_;  // guards the exposure
  Exposure exposure_;         // of the last frame, or asked for since
};

}  // namespace

Result<std::unique_ptr<CameraStream>> open_libcamera_stream(const CameraSettings& settings) {
  const std::string name = settings.device.empty() ? "the only camera" : settings.device;
  if (settings.trigger == CameraTrigger::software)
    return job_failed("{}: libcamera knows no trigger by software; camera.trigger: free or hardware", name);
  auto stream = std::make_unique<LibcameraStream>(name, settings);
  if (auto started = stream->start(); !started) return job_failed("{}: {}", name, started.error().message);
  return stream;
}

}  // namespace imprint
