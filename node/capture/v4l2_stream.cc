#include "node/capture/v4l2_stream.h"

#include <linux/videodev2.h>
#include <time.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include "lib/clock/wall_clock.h"
#include "node/capture/v4l2_controls.h"
#include "node/capture/v4l2_format.h"

namespace imprint {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

std::int64_t monotonic_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecondNs + now.tv_nsec;
}

// The driver's stamp on the wall clock; now where it stamps with another clock than the monotonic one.
std::int64_t wall_time_ns(const v4l2_buffer& buffer) {
  if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) return wall_clock_ns();
  const std::int64_t stamp_ns = buffer.timestamp.tv_sec * kSecondNs + buffer.timestamp.tv_usec * 1000;
  return wall_clock_ns() - (monotonic_ns() - stamp_ns);
}

// A v4l2_buffer with the one plane that the interface for several wants beside it.
struct Buffer {
  v4l2_buffer of{};
  v4l2_plane plane{};

  Buffer(V4l2Planes planes, std::uint32_t index) {
    of.index = index;
    of.type = buffer_type(planes);
    of.memory = V4L2_MEMORY_MMAP;
    if (planes == V4l2Planes::multi) {
      of.m.planes = &plane;
      of.length = 1;
    }
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  [[nodiscard]] bool has_planes() const { return of.type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }
  [[nodiscard]] std::size_t length() const { return has_planes() ? plane.length : of.length; }
  [[nodiscard]] std::size_t used() const { return has_planes() ? plane.bytesused : of.bytesused; }
  [[nodiscard]] std::int64_t offset() const { return has_planes() ? plane.m.mem_offset : of.m.offset; }
};

// The driver's buffers, in memory. A frame that is out keeps them, and with them the device, alive.
class Buffers {
 public:
  Buffers(std::shared_ptr<V4l2Device> device, V4l2Planes planes) : device_(std::move(device)), planes_(planes) {}

  Result<void> allocate(int count) {
    v4l2_requestbuffers request{};
    request.count = static_cast<std::uint32_t>(count);
    request.type = buffer_type(planes_);
    request.memory = V4L2_MEMORY_MMAP;
    if (const int fault = device_->call(VIDIOC_REQBUFS, &request))
      return job_failed("no memory for frames: {}", std::strerror(fault));
    if (request.count < static_cast<std::uint32_t>(count))
      return job_failed("camera.buffers: expected {}, the camera has memory for {}", count, request.count);
    for (std::uint32_t index = 0; index < request.count; ++index) {
      Buffer buffer(planes_, index);
      if (const int fault = device_->call(VIDIOC_QUERYBUF, &buffer.of))
        return job_failed("buffer {}: {}", index, std::strerror(fault));
      auto memory = device_->map(buffer.length(), buffer.offset());
      if (!memory) return job_failed("buffer {}: its {} bytes cannot be mapped", index, buffer.length());
      memory_.emplace_back(std::move(memory), buffer.length());
      if (const int fault = give_back(index)) return job_failed("buffer {}: {}", index, std::strerror(fault));
    }
    return {};
  }

  int give_back(std::uint32_t index) {
    Buffer buffer(planes_, index);
    return device_->call(VIDIOC_QBUF, &buffer.of);
  }

  [[nodiscard]] std::span<const std::uint8_t> bytes(std::uint32_t index, std::size_t used) const {
    const auto& [memory, length] = memory_.at(index);
    return {memory.get(), used == 0 ? length : std::min(used, length)};
  }
  [[nodiscard]] std::size_t size() const { return memory_.size(); }

 private:
  std::shared_ptr<V4l2Device> device_;
  V4l2Planes planes_;
  std::vector<std::pair<std::shared_ptr<std::uint8_t>, std::size_t>> memory_;
};

class V4l2Stream final : public CameraStream {
 public:
  V4l2Stream(CameraSettings settings, std::shared_ptr<V4l2Device> device, V4l2Planes planes)
      : settings_(std::move(settings)), device_(std::move(device)), planes_(planes), controls_(device_) {}
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;

  ~V4l2Stream() override {
    int type = static_cast<int>(buffer_type(planes_));
    if (running_) device_->call(VIDIOC_STREAMOFF, &type);
  }

  Result<void> start() {
    const auto layout = set_v4l2_format(*device_, planes_, settings_);
    if (!layout) return pass_on(layout.error());
    layout_ = *layout;
    for (const CameraControl& control : settings_.controls)
      if (auto set = controls_.set(control); !set) return set;
    if (settings_.exposure.time_us > 0.0) {
      if (auto set = set_exposure(settings_.exposure); !set) return set;
    } else {
      read_exposure();
    }
    buffers_ = std::make_shared<Buffers>(device_, planes_);
    if (auto made = buffers_->allocate(settings_.buffers); !made) return made;
    int type = static_cast<int>(buffer_type(planes_));
    if (const int fault = device_->call(VIDIOC_STREAMON, &type))
      return job_failed("cannot be started: {}", std::strerror(fault));
    running_ = true;
    return {};
  }

  Result<std::optional<RawFrame>> next(std::chrono::milliseconds timeout) override {
    if (const int fault = device_->wait(timeout)) {
      if (fault == ETIMEDOUT) return std::nullopt;
      return lost(fault);
    }
    Buffer buffer(planes_, 0);
    if (const int fault = device_->call(VIDIOC_DQBUF, &buffer.of)) {
      if (fault == EAGAIN) return std::nullopt;
      return lost(fault);
    }
    if (buffer.of.index >= buffers_->size())
      return job_failed("{}: the driver gave buffer {} of {}", settings_.device, buffer.of.index, buffers_->size());
    return frame_of(buffer);
  }

  Result<void> set_exposure(const Exposure& wanted) override {
    const std::lock_guard lock(mutex_);
    if (auto set = controls_.set(settings_.exposure_control, std::llround(wanted.time_us / settings_.exposure_unit_us));
        !set)
      return job_failed("{}: {}", settings_.device, set.error().message);
    if (settings_.gain_unit_db > 0.0) {
      if (auto set = controls_.set(settings_.gain_control, std::llround(wanted.gain_db / settings_.gain_unit_db)); !set)
        return job_failed("{}: {}", settings_.device, set.error().message);
    } else if (wanted.gain_db != 0.0) {
      return job_failed("{}: cannot amplify by {} dB: camera.gain_unit_db is not known", settings_.device,
                        wanted.gain_db);
    }
    read_exposure();
    return {};
  }

  [[nodiscard]] Exposure exposure() const override {
    const std::lock_guard lock(mutex_);
    return exposure_;
  }

  Result<void> fire() override {
    return job_failed("{}: Video4Linux knows no trigger by software; camera.trigger: free or hardware",
                      settings_.device);
  }

 private:
  // As the driver rounded it.
  void read_exposure() {
    const auto time = controls_.get(settings_.exposure_control);
    const auto gain = controls_.get(settings_.gain_control);
    exposure_.time_us = time ? settings_.exposure_unit_us * static_cast<double>(*time) : 0.0;
    exposure_.gain_db = gain ? settings_.gain_unit_db * static_cast<double>(*gain) : 0.0;
  }

  tl::unexpected<Error> lost(int fault) const {
    return job_failed("{}: lost: {}", settings_.device, std::strerror(fault));
  }

  Result<std::optional<RawFrame>> frame_of(const Buffer& buffer) {
    const std::uint32_t index = buffer.of.index;
    RawFrame frame;
    frame.layout = layout_;
    frame.sensor_time_ns = wall_time_ns(buffer.of);
    frame.sequence = buffer.of.sequence;
    // 32 bits that may wrap.
    frame.missed = last_sequence_ ? static_cast<std::uint32_t>(buffer.of.sequence - *last_sequence_ - 1) : 0;
    if (frame.missed >= 1U << 31U) frame.missed = 0;  // counted back: a driver that began anew
    last_sequence_ = buffer.of.sequence;
    frame.damaged = (buffer.of.flags & V4L2_BUF_FLAG_ERROR) != 0U;
    frame.exposure = exposure();
    frame.bytes = buffers_->bytes(index, buffer.used());
    // What cannot be given back is no loss here: the next dequeue says what is wrong.
    frame.buffer = std::shared_ptr<const void>(frame.bytes.data(),
                                               [buffers = buffers_, index](const void*) { buffers->give_back(index); });
    return frame;
  }

  const CameraSettings settings_;
  const std::shared_ptr<V4l2Device> device_;
  const V4l2Planes planes_;
  V4l2Controls controls_;
  PixelLayout layout_;
  std::shared_ptr<Buffers> buffers_;
  bool running_ = false;
  std::optional<std::uint32_t> last_sequence_;
  mutable std::mutex mutex_;  // guards the exposure and its controls
  Exposure exposure_;
};

}  // namespace

Result<std::unique_ptr<CameraStream>> open_v4l2_stream(const CameraSettings& settings, const OpenV4l2Device& open) {
  if (settings.trigger == CameraTrigger::software)
    return job_failed("{}: Video4Linux knows no trigger by software; camera.trigger: free or hardware",
                      settings.device);
  auto device = open(settings.device);
  if (!device) return pass_on(device.error());
  const auto named = [&](const Error& error) { return job_failed("{}: {}", settings.device, error.message); };
  const auto planes = v4l2_planes(**device);
  if (!planes) return named(planes.error());
  auto stream = std::make_unique<V4l2Stream>(settings, std::move(*device), *planes);
  if (auto started = stream->start(); !started) return named(started.error());
  return stream;
}

}  // namespace imprint
