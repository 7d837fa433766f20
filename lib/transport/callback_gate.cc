#include "lib/transport/callback_gate.h"

#include <algorithm>

namespace imprint {

bool CallbackGate::enter() {
  const std::lock_guard lock(mutex_);
  if (open_) inside_.push_back(std::this_thread::get_id());
  return open_;
}

void CallbackGate::leave() {
  {
    const std::lock_guard lock(mutex_);
    inside_.erase(std::find(inside_.begin(), inside_.end(), std::this_thread::get_id()));
  }
  left_.notify_all();
}

void CallbackGate::close() {
  std::unique_lock lock(mutex_);
  open_ = false;
  const auto self = std::this_thread::get_id();
  left_.wait(lock, [&] { return std::all_of(inside_.begin(), inside_.end(), [&](auto id) { return id == self; }); });
}

}  // namespace imprint
