#pragma once

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "node/capture/v4l2_device.h"

namespace imprint {

/// A Video4Linux camera in memory, as far as a V4l2Stream can tell: Y10 of any size, two controls.
class FakeV4l2 final : public V4l2Device {
 public:
  struct Control {
    std::uint32_t id;
    std::string title;
    std::int64_t lowest, highest, value;
  };

  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<std::uint32_t> formats{V4L2_PIX_FMT_RGB24, V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y10};
  std::uint32_t max_width = 4656;
  std::uint32_t max_buffers = 32;
  std::vector<Control> controls{{0x980911, "Exposure Time, Absolute", 1, 5000, 100}, {0x980913, "Gain", 0, 480, 0}};
  std::map<unsigned long, int> faults;  ///< errno a request fails with
  v4l2_format format{};
  bool streaming = false;
  int input = 0;

  /// A picture arrives whose bytes all are `value`; dropped when the camera holds no buffer.
  bool arrive(std::uint8_t value, std::uint32_t sequence, std::int64_t time_us, std::uint32_t flags = 0) {
    if (queued_.empty()) return false;
    const std::uint32_t index = queued_.front();
    queued_.pop_front();
    std::fill(memory_[index].begin(), memory_[index].end(), value);
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.sequence = sequence;
    buffer.flags = flags | V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    buffer.timestamp = {time_us / 1'000'000, time_us % 1'000'000};
    ready_.push_back(buffer);
    return true;
  }
  [[nodiscard]] std::size_t queued() const { return queued_.size(); }

  int wait(std::chrono::milliseconds) override {
    return ready_.empty() && !faults.contains(VIDIOC_DQBUF) ? ETIMEDOUT : 0;
  }

  std::shared_ptr<std::uint8_t> map(std::size_t length, std::int64_t offset) override {
    auto& memory = memory_.at(static_cast<std::size_t>(offset));
    if (memory.size() != length) return nullptr;
    return {memory.data(), [](std::uint8_t*) {}};
  }

  int call(unsigned long request, void* argument) override {
    if (const auto fault = faults.find(request); fault != faults.end()) return fault->second;
    switch (request) {
      case VIDIOC_QUERYCAP:
        static_cast<v4l2_capability*>(argument)->capabilities = V4L2_CAP_DEVICE_CAPS;
        static_cast<v4l2_capability*>(argument)->device_caps = capabilities;
        return 0;
      case VIDIOC_S_INPUT:
        input = *static_cast<int*>(argument);
        return 0;
      case VIDIOC_ENUM_FMT:
        return enumerate(*static_cast<v4l2_fmtdesc*>(argument));
      case VIDIOC_G_FMT:
        *static_cast<v4l2_format*>(argument) = format;
        return 0;
      case VIDIOC_S_FMT:
        return set_format(*static_cast<v4l2_format*>(argument));
      case VIDIOC_S_PARM:
        return 0;
      case VIDIOC_QUERY_EXT_CTRL:
        return describe(*static_cast<v4l2_query_ext_ctrl*>(argument));
      case VIDIOC_S_EXT_CTRLS:
        return control(*static_cast<v4l2_ext_controls*>(argument), true);
      case VIDIOC_G_EXT_CTRLS:
        return control(*static_cast<v4l2_ext_controls*>(argument), false);
      case VIDIOC_REQBUFS:
        return allocate(*static_cast<v4l2_requestbuffers*>(argument));
      case VIDIOC_QUERYBUF:
        return locate(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_QBUF:
        queued_.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_DQBUF:
        return take(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_STREAMON:
        streaming = true;
        return 0;
      case VIDIOC_STREAMOFF:
        streaming = false;
        return 0;
      default:
        return ENOTTY;
    }
  }

 private:
  [[nodiscard]] bool multi() const { return (capabilities & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0U; }

  int enumerate(v4l2_fmtdesc& description) const {
    if (description.index >= formats.size()) return EINVAL;
    description.pixelformat = formats[description.index];
    return 0;
  }

  int set_format(v4l2_format& wanted) {
    std::uint32_t stride = 0;
    const auto fill = [&](auto& pixels) {
      if (pixels.width == 0) pixels.width = 640;
      if (pixels.height == 0) pixels.height = 480;
      if (pixels.width > max_width) pixels.width = max_width;
      stride = pixels.width * (pixels.pixelformat == V4L2_PIX_FMT_GREY ? 1 : 2) + 6;  // rows with a gap
      size_ = stride * pixels.height;
    };
    if (multi()) {
      fill(wanted.fmt.pix_mp);
      wanted.fmt.pix_mp.plane_fmt[0].bytesperline = stride;
    } else {
      fill(wanted.fmt.pix);
      wanted.fmt.pix.bytesperline = stride;
    }
    format = wanted;
    return 0;
  }

  int describe(v4l2_query_ext_ctrl& query) const {
    const std::uint32_t last = query.id & V4L2_CTRL_ID_MASK;
    for (const Control& control : controls) {
      if (control.id <= last) continue;
      query = {};
      query.id = control.id;
      query.type = V4L2_CTRL_TYPE_INTEGER;
      query.minimum = control.lowest;
      query.maximum = control.highest;
      std::strncpy(query.name, control.title.c_str(), sizeof query.name - 1);
      return 0;
    }
    return EINVAL;
  }

  int control(v4l2_ext_controls& asked, bool set) {
    for (Control& known : controls) {
      if (known.id != asked.controls[0].id) continue;
      if (set) known.value = asked.controls[0].value;
      asked.controls[0].value = static_cast<std::int32_t>(known.value);
      return 0;
    }
    return EINVAL;
  }

  int allocate(v4l2_requestbuffers& request) {
    request.count = std::min(request.count, max_buffers);
    memory_.assign(request.count, std::vector<std::uint8_t>(size_));
    return 0;
  }

  int locate(v4l2_buffer& buffer) {
    if (multi()) {
      buffer.m.planes[0].length = size_;
      buffer.m.planes[0].m.mem_offset = buffer.index;
    } else {
      buffer.length = size_;
      buffer.m.offset = buffer.index;
    }
    return 0;
  }

  int take(v4l2_buffer& buffer) {
    if (ready_.empty()) return EAGAIN;
    v4l2_plane* const planes = buffer.m.planes;
    const v4l2_buffer& next = ready_.front();
    buffer.index = next.index;
    buffer.sequence = next.sequence;
    buffer.flags = next.flags;
    buffer.timestamp = next.timestamp;
    if (multi()) {
      planes[0].bytesused = size_;
    } else {
      buffer.bytesused = size_;
    }
    ready_.pop_front();
    return 0;
  }

  std::uint32_t size_ = 0;
  std::vector<std::vector<std::uint8_t>> memory_;
  std::deque<std::uint32_t> queued_;
  std::deque<v4l2_buffer> ready_;
};

}  // namespace imprint
