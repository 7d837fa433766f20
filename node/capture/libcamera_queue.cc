#include "node/capture/libcamera_queue.h"

#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <time.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include <libcamera/control_ids.h>

#include "lib/clock/wall_clock.h"
#include "node/capture/libcamera_format.h"

namespace imprint {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

// libcamera's stamps, of the clock that Video4Linux stamps with, on the wall clock; now where the camera gives none.
std::int64_t wall_time_ns(std::int64_t stamp_ns) {
  if (stamp_ns == 0) return wall_clock_ns();
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return wall_clock_ns() - (now.tv_sec * kSecondNs + now.tv_nsec - stamp_ns);
}

// Caches are to be in order while we read; memory that is not a DMA buffer has nothing to be done.
void sync_caches(int file, std::uint64_t flags) {
  dma_buf_sync sync{flags | DMA_BUF_SYNC_READ};
  ::ioctl(file, DMA_BUF_IOCTL_SYNC, &sync);
}

}  // namespace

Result<std::shared_ptr<LibcameraMemory>> LibcameraMemory::map(const libcamera::FrameBuffer& buffer) {
  const libcamera::FrameBuffer::Plane& plane = buffer.planes().front();
  const std::size_t offset = plane.offset == libcamera::FrameBuffer::Plane::kInvalidOffset ? 0 : plane.offset;
  void* mapped = ::mmap(nullptr, offset + plane.length, PROT_READ, MAP_SHARED, plane.fd.get(), 0);
  if (mapped == MAP_FAILED) return job_failed("a buffer's {} bytes cannot be mapped", plane.length);
  return std::shared_ptr<LibcameraMemory>(
      new LibcameraMemory(plane.fd, static_cast<std::uint8_t*>(mapped), offset, plane.length));
}

LibcameraMemory::~LibcameraMemory() { ::munmap(mapped_, offset_ + length_); }

std::span<const std::uint8_t> LibcameraMemory::begin_read(std::size_t used) {
  sync_caches(file_.get(), DMA_BUF_SYNC_START);
  return {mapped_ + offset_, used == 0 ? length_ : std::min(used, length_)};
}

void LibcameraMemory::end_read() { sync_caches(file_.get(), DMA_BUF_SYNC_END); }

Result<void> LibcameraQueue::allocate(libcamera::Stream* stream, std::size_t least) {
  allocator_ = std::make_unique<libcamera::FrameBufferAllocator>(camera_);
  if (const int made = allocator_->allocate(stream); made < 0)
    return job_failed("no memory for frames: {}", std::strerror(-made));
  const auto& buffers = allocator_->buffers(stream);
  if (buffers.size() < least)
    return job_failed(
        "camera.recent_frames: the camera has {} buffers, expected at least {}: one being filled, one next, "
        "and the recent frames",
        buffers.size(), least);
  for (const auto& buffer : buffers) {
    auto memory = LibcameraMemory::map(*buffer);
    if (!memory) return pass_on(memory.error());
    auto request = camera_->createRequest(slots_.size());
    if (!request || request->addBuffer(stream, buffer.get()) != 0) return job_failed("takes no request for a frame");
    slots_.push_back({std::move(request), std::move(*memory), {}});
  }
  return {};
}

Result<void> LibcameraQueue::start(libcamera::Stream* stream, std::size_t least, const libcamera::ControlList& controls,
                                   const Exposure& asked) {
  if (auto made = allocate(stream, least); !made) return made;
  // Both are called in libcamera's own thread.
  camera_->requestCompleted.connect(this, [this](libcamera::Request* request) {
    if (request->status() == libcamera::Request::RequestCancelled) return;
    {
      const std::lock_guard lock(mutex_);
      completed_.push_back(request->cookie());
    }
    changed_.notify_one();
  });
  camera_->disconnected.connect(this, [this] {
    {
      const std::lock_guard lock(mutex_);
      gone_ = true;
    }
    changed_.notify_one();
  });
  libcamera::ControlList at_start = controls;
  if (const int fault = camera_->start(&at_start)) return job_failed("cannot be started: {}", std::strerror(-fault));
  const std::lock_guard lock(mutex_);
  running_ = true;
  pending_ = controls;
  asked_ = asked;
  for (Slot& slot : slots_)
    if (const int fault = give(slot)) return job_failed("takes no request for a frame: {}", std::strerror(-fault));
  return {};
}

void LibcameraQueue::stop() {
  {
    const std::lock_guard lock(mutex_);
    running_ = false;
  }
  camera_->stop();
  camera_->requestCompleted.disconnect(this);
  camera_->disconnected.disconnect(this);
  const std::lock_guard lock(mutex_);
  completed_.clear();
  slots_.clear();
  allocator_.reset();
}

void LibcameraQueue::set(const libcamera::ControlList& controls, const Exposure& asked) {
  const std::lock_guard lock(mutex_);
  for (const auto& [id, value] : controls) pending_.set(id, value);
  asked_ = asked;
}

int LibcameraQueue::give(Slot& slot) {
  for (const auto& [id, value] : pending_) slot.request->controls().set(id, value);
  pending_.clear();
  slot.asked = asked_;
  return camera_->queueRequest(slot.request.get());
}

void LibcameraQueue::give_back(std::size_t index) {
  const std::lock_guard lock(mutex_);
  if (!running_) return;
  Slot& slot = slots_.at(index);
  slot.request->reuse(libcamera::Request::ReuseBuffers);
  give(slot);  // what is not taken is no loss here: a camera that takes none any more is gone, or stalls
}

Result<std::optional<LibcameraFrame>> LibcameraQueue::next(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, timeout, [this] { return gone_ || !completed_.empty(); });
  if (gone_) return job_failed("lost: it was unplugged");
  if (completed_.empty()) return std::nullopt;
  const std::size_t index = completed_.front();
  completed_.pop_front();
  if (is_picture(metadata_of(slots_.at(index)).status)) return frame_of(index);
  lock.unlock();
  give_back(index);
  return std::nullopt;
}

const libcamera::FrameMetadata& LibcameraQueue::metadata_of(const Slot& slot) {
  return slot.request->buffers().begin()->second->metadata();
}

LibcameraFrame LibcameraQueue::frame_of(std::size_t index) {
  Slot& slot = slots_.at(index);
  const libcamera::FrameMetadata& metadata = metadata_of(slot);
  const auto planes = metadata.planes();
  LibcameraFrame taken;
  RawFrame& frame = taken.frame;
  frame.damaged = metadata.status == libcamera::FrameMetadata::FrameError;
  frame.sequence = metadata.sequence;
  if (!frame.damaged) taken.counted = metadata.sequence;
  const auto stamp_ns = slot.request->metadata().get(libcamera::controls::SensorTimestamp);
  frame.sensor_time_ns = wall_time_ns(stamp_ns ? *stamp_ns : static_cast<std::int64_t>(metadata.timestamp));
  frame.exposure = exposure_of(slot.request->metadata(), slot.asked);
  frame.bytes = slot.memory->begin_read(planes.empty() ? 0 : planes.front().bytesused);
  frame.buffer = std::shared_ptr<const void>(frame.bytes.data(),
                                             [queue = weak_from_this(), memory = slot.memory, index](const void*) {
                                               memory->end_read();
                                               if (const auto camera = queue.lock()) camera->give_back(index);
                                             });
  return taken;
}

}  // namespace imprint
