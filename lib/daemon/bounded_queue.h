#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace imprint {

/// Hands work from the transport's threads to a worker's. Never blocks the giver: what does not fit is refused.
template <class T>
class BoundedQueue {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}

  /// False when the queue is full or closed.
  bool push(T item) {
    {
      const std::lock_guard lock(mutex_);
      if (closed_ || items_.size() >= capacity_) return false;
      items_.push_back(std::move(item));
    }
    changed_.notify_one();
    return true;
  }

  /// The next item; none when there was none until `until`, or the queue is closed and empty.
  std::optional<T> pop_until(Time until) {
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, until, [&] { return closed_ || !items_.empty(); });
    return take_front();
  }

  /// The next item; none when there is none at this moment.
  std::optional<T> try_pop() {
    const std::lock_guard lock(mutex_);
    return take_front();
  }

  /// The next item, however long it takes; none when the queue is closed and empty.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || !items_.empty(); });
    return take_front();
  }

  /// Takes nothing more; what is queued can still be popped.
  void close() { close_and(false); }
  /// Takes nothing more and forgets what is queued.
  void drop() { close_and(true); }

  /// Closed and empty: nothing will come any more.
  [[nodiscard]] bool finished() const {
    const std::lock_guard lock(mutex_);
    return closed_ && items_.empty();
  }

 private:
  void close_and(bool forget) {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
      if (forget) items_.clear();
    }
    changed_.notify_all();
  }

  std::optional<T> take_front() {
    if (items_.empty()) return std::nullopt;
    std::optional<T> item(std::move(items_.front()));
    items_.pop_front();
    return item;
  }

  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<T> items_;
  bool closed_ = false;
};

}  // namespace imprint
