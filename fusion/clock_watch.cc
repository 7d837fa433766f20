#include "fusion/clock_watch.h"

#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

#include "lib/clock/wall_clock.h"
#include "lib/log/log.h"
#include "lib/wire/wire.h"

namespace imprint {
namespace {

constexpr auto kPeriod = std::chrono::seconds(10);
constexpr auto kTimeout = std::chrono::milliseconds(1000);
constexpr int kRoundTrips = 3;

}  // namespace

ClockOffset clock_offset(std::int64_t asked_ns, std::int64_t received_ns, std::int64_t sent_ns,
                         std::int64_t answered_ns) {
  const std::int64_t way_ns = (answered_ns - asked_ns) - (sent_ns - received_ns);
  // Halves of differences: sums of two times since 1970 would not fit.
  return {(received_ns - asked_ns) / 2 + (sent_ns - answered_ns) / 2, std::abs(way_ns) / 2 + 1};
}

ClockWatch::ClockWatch(Transport& transport, Keys keys, LineBoard& board, double limit_s)
    : transport_(transport), keys_(std::move(keys)), board_(board), limit_s_(limit_s) {
  worker_ = std::thread([this] { work(); });
}

ClockWatch::~ClockWatch() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  worker_.join();
}

void ClockWatch::set_alive(const std::string& camera_id, bool alive) {
  {
    const std::lock_guard lock(mutex_);
    if (!alive) {
      alive_.erase(camera_id);
      return;
    }
    alive_.insert(camera_id);
    came_ = true;
  }
  changed_.notify_all();
}

std::optional<ClockOffset> ClockWatch::offset(const std::string& camera_id) const {
  const std::lock_guard lock(mutex_);
  const auto found = offsets_.find(camera_id);
  return found == offsets_.end() ? std::nullopt : std::optional(found->second);
}

void ClockWatch::work() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    came_ = false;
    const std::vector<std::string> cameras(alive_.begin(), alive_.end());
    lock.unlock();
    for (const std::string& camera : cameras) measure(camera);
    lock.lock();
    changed_.wait_for(lock, kPeriod, [this] { return stopping_ || came_; });
  }
}

void ClockWatch::measure(const std::string& camera_id) {
  std::optional<ClockOffset> best;
  const auto before = offset(camera_id);
  for (int i = 0; i < kRoundTrips; ++i) {
    const auto& known = best ? best : before;
    const ClockQuestion question{known ? std::optional(known->offset_ns) : std::nullopt};
    const std::int64_t asked_ns = wall_clock_ns();
    const auto replies = transport_.get(keys_.service(camera_id, "clock"), encode_clock_question(question), kTimeout);
    const std::int64_t answered_ns = wall_clock_ns();
    if (!replies || replies->empty()) return;  // its liveliness is told elsewhere
    const auto reading = decode_clock_reading(replies->front().payload);
    if (!reading) {
      spdlog::warn("camera {}: {}", camera_id, reading.error().message);
      return;
    }
    const ClockOffset offset = clock_offset(asked_ns, reading->received_ns, reading->sent_ns, answered_ns);
    if (!best || offset.uncertainty_ns < best->uncertainty_ns) best = offset;
  }
  const double offset_s = 1e-9 * static_cast<double>(best->offset_ns);
  bool is_off = false;
  {
    const std::lock_guard lock(mutex_);
    offsets_[camera_id] = *best;
    is_off = std::abs(offset_s) > (alarmed_.contains(camera_id) ? 0.5 * limit_s_ : limit_s_);
    if (is_off) {
      alarmed_.insert(camera_id);
    } else {
      alarmed_.erase(camera_id);
    }
  }
  board_.set_clock(camera_id, *best);
  board_.set_alarm("clock_" + camera_id,
                   is_off ? fmt::format("camera {}: its clock is {:.3f} s {} fusion's; times are corrected, but set up "
                                        "chrony or PTP",
                                        camera_id, std::abs(offset_s), offset_s > 0 ? "ahead of" : "behind")
                          : "");
}

}  // namespace imprint
