#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "lib/transport/transport.h"

namespace imprint::test {

/// How long a test waits for what must happen; on an idle machine it takes milliseconds.
inline constexpr std::chrono::seconds kPatience{15};

/// A TCP port of the loopback that was free just now.
inline int free_port() {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  const bool bound = bind(fd, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                     getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  close(fd);
  return bound ? ntohs(address.sin_port) : -1;
}

template <class T>
T opened(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

/// A fusion that routes, nodes and tools that connect to it, over Zenoh on the loopback.
class ZenohPlant {
 public:
  std::unique_ptr<Transport> fusion() { return opened(open_zenoh({.listen = {endpoint_}, .router = true})); }
  std::unique_ptr<Transport> node() { return opened(open_zenoh({.connect = {endpoint_}})); }
  std::unique_ptr<Transport> tool() { return opened(open_zenoh({.connect = {endpoint_}, .tool = true})); }

 private:
  std::string endpoint_ = "tcp/127.0.0.1:" + std::to_string(free_port());
};

/// The same in memory.
class MemoryPlant {
 public:
  std::unique_ptr<Transport> fusion() { return open_memory(bus_); }
  std::unique_ptr<Transport> node() { return open_memory(bus_); }
  std::unique_ptr<Transport> tool() { return open_memory(bus_); }

 private:
  std::shared_ptr<MemoryBus> bus_ = make_memory_bus();
};

/// What callbacks gathered, for a test to wait on.
template <class T>
class Gathered {
 public:
  void add(T value) {
    const std::lock_guard lock(mutex_);
    values_.push_back(std::move(value));
    changed_.notify_all();
  }
  std::vector<T> values() const {
    const std::lock_guard lock(mutex_);
    return values_;
  }
  /// Waits until there are `count`, then a moment longer for any that should not have come.
  std::vector<T> wait_for(std::size_t count, std::chrono::milliseconds settle = std::chrono::milliseconds(100)) const {
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kPatience, [&] { return values_.size() >= count; });
    }
    std::this_thread::sleep_for(settle);
    return values();
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::vector<T> values_;
};

template <class Condition>
bool eventually(Condition&& condition) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

inline Bytes bytes(std::string_view text) { return {text.begin(), text.end()}; }
inline std::string text(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

}  // namespace imprint::test
