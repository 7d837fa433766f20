#pragma once

#include <chrono>

namespace imprint {

/// SIGTERM and SIGINT as something to wait for. Made before any thread is, so that all threads leave the two to it.
class StopSignal {
 public:
  StopSignal();

  /// True as soon as the process was told to stop, false when `timeout` has passed first.
  [[nodiscard]] bool wait_for(std::chrono::milliseconds timeout);

 private:
  bool stopped_ = false;
};

}  // namespace imprint
