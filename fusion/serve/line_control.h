#pragma once

#include <functional>
#include <mutex>

#include "lib/result/result.h"
#include "lib/wire/wire.h"

namespace imprint {

/// What may be done to the line from outside the network of cameras: the page's button, a PLC's input. While no line is
/// connected nothing can be. Safe to use from several threads.
class LineControl {
 public:
  using Fire = std::function<Result<void>(const Trigger&)>;

  void connect(Fire fire) {
    const std::lock_guard lock(mutex_);
    fire_ = std::move(fire);
  }
  /// After this returns nothing is called any more.
  void disconnect() { connect({}); }

  /// Makes all cameras take an observation. Fails (job_failed) when that cannot be sent.
  Result<void> fire(const Trigger& trigger) {
    const std::lock_guard lock(mutex_);
    if (!fire_) return job_failed("the line is not connected at this moment: try again");
    return fire_(trigger);
  }

 private:
  std::mutex mutex_;
  Fire fire_;
};

}  // namespace imprint
