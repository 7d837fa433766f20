#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <libcamera/camera.h>
#include <libcamera/framebuffer_allocator.h>
#include <libcamera/request.h>

#include "lib/result/result.h"
#include "node/capture/camera_stream.h"

namespace imprint {

/// The memory of a camera's buffer as this process sees it.
class LibcameraMemory {
 public:
  /// The first plane. Fails (job_failed) when it cannot be mapped.
  static Result<std::shared_ptr<LibcameraMemory>> map(const libcamera::FrameBuffer& buffer);
  LibcameraMemory(const LibcameraMemory&) = delete;
  LibcameraMemory& operator=(const LibcameraMemory&) = delete;
  ~LibcameraMemory();

  /// What the camera wrote, `used` bytes of it (0: all), until `end_read`.
  std::span<const std::uint8_t> begin_read(std::size_t used);
  void end_read();

 private:
  LibcameraMemory(libcamera::SharedFD file, std::uint8_t* mapped, std::size_t offset, std::size_t length)
      : file_(std::move(file)), mapped_(mapped), offset_(offset), length_(length) {}

  const libcamera::SharedFD file_;
  std::uint8_t* const mapped_;
  const std::size_t offset_;
  const std::size_t length_;
};

/// A request of the camera that came back, with a frame.
struct LibcameraFrame {
  RawFrame frame;                        ///< without its layout
  std::optional<std::uint32_t> counted;  ///< as the driver counts; none of a frame that failed
};

/// The requests that go round between a camera and us. A frame that is out keeps its memory; its request goes back to
/// the camera with it, unless the queue has stopped.
class LibcameraQueue : public std::enable_shared_from_this<LibcameraQueue> {
 public:
  explicit LibcameraQueue(std::shared_ptr<libcamera::Camera> camera) : camera_(std::move(camera)) {}

  /// Allocates the stream's buffers, at least `least` of them, starts the camera with these controls and gives it all.
  Result<void> start(libcamera::Stream* stream, std::size_t least, const libcamera::ControlList& controls,
                     const Exposure& asked);
  void stop();
  /// Hold from the next request on that goes to the camera.
  void set(const libcamera::ControlList& controls, const Exposure& asked);
  /// Nothing within the timeout, or an error when the camera is gone.
  Result<std::optional<LibcameraFrame>> next(std::chrono::milliseconds timeout);

 private:
  struct Slot {
    std::unique_ptr<libcamera::Request> request;
    std::shared_ptr<LibcameraMemory> memory;
    Exposure asked;
  };

  Result<void> allocate(libcamera::Stream* stream, std::size_t least);
  int give(Slot& slot);  // with the lock held
  void give_back(std::size_t index);
  static const libcamera::FrameMetadata& metadata_of(const Slot& slot);
  LibcameraFrame frame_of(std::size_t index);

  const std::shared_ptr<libcamera::Camera> camera_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Slot> slots_;
  std::deque<std::size_t> completed_;
  libcamera::ControlList pending_;
  Exposure asked_;
  bool running_ = false;
  bool gone_ = false;
};

}  // namespace imprint
