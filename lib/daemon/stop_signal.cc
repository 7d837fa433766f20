#include "lib/daemon/stop_signal.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <ctime>

namespace imprint {
namespace {

sigset_t stop_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGINT);
  return set;
}

}  // namespace

StopSignal::StopSignal() {
  const sigset_t set = stop_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

bool StopSignal::wait_for(std::chrono::milliseconds timeout) {
  using std::chrono::steady_clock;
  const sigset_t set = stop_signals();
  const auto until = steady_clock::now() + timeout;
  while (!stopped_) {
    const auto left = std::chrono::duration_cast<std::chrono::nanoseconds>(until - steady_clock::now()).count();
    const auto rest = std::max<std::int64_t>(left, 0);
    const timespec wait{static_cast<std::time_t>(rest / 1'000'000'000), static_cast<long>(rest % 1'000'000'000)};
    if (sigtimedwait(&set, nullptr, &wait) > 0)
      stopped_ = true;
    else if (errno == EAGAIN)
      return false;
  }
  return true;
}

}  // namespace imprint
