#include "node/capture/v4l2_device.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace imprint {
namespace {

class KernelDevice final : public V4l2Device {
 public:
  explicit KernelDevice(int file) : file_(file) {}
  KernelDevice(const KernelDevice&) = delete;
  KernelDevice& operator=(const KernelDevice&) = delete;
  ~KernelDevice() override { ::close(file_); }

  int call(unsigned long request, void* argument) override {
    int status = 0;
    do {
      status = ::ioctl(file_, request, argument);
    } while (status == -1 && errno == EINTR);
    return status == -1 ? errno : 0;
  }

  int wait(std::chrono::milliseconds timeout) override {
    pollfd ready{.fd = file_, .events = POLLIN, .revents = 0};
    const int count = ::poll(&ready, 1, static_cast<int>(timeout.count()));
    if (count < 0) return errno == EINTR ? ETIMEDOUT : errno;
    return count == 0 ? ETIMEDOUT : 0;
  }

  std::shared_ptr<std::uint8_t> map(std::size_t length, std::int64_t offset) override {
    void* memory = ::mmap(nullptr, length, PROT_READ, MAP_SHARED, file_, offset);
    if (memory == MAP_FAILED) return nullptr;
    return {static_cast<std::uint8_t*>(memory), [length](std::uint8_t* at) { ::munmap(at, length); }};
  }

 private:
  int file_;
};

}  // namespace

Result<std::shared_ptr<V4l2Device>> open_v4l2_device(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return job_failed("{}: {}", path, std::strerror(errno));
  return std::make_shared<KernelDevice>(file);
}

}  // namespace imprint
