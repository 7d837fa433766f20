#include "node/capture/live_source.h"

#include <algorithm>
#include <utility>

#include "lib/clock/wall_clock.h"
#include "lib/log/log.h"

namespace imprint {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr auto kPoll = milliseconds(100);  // in which the thread sees that it is to end
constexpr int kFramesOnTheirWay = 2;       // exposed before a new exposure held: one being read out, one begun

double milliseconds_of(std::int64_t time_ns) { return 1e-6 * static_cast<double>(time_ns); }

}  // namespace

LiveSource::LiveSource(std::string name, OpenStream open, const LiveConfig& config)
    : name_(std::move(name)),
      open_(std::move(open)),
      config_(config),
      recent_(config.recent_frames),
      wanted_(config.exposure),
      thread_([this] { run(); }) {}

LiveSource::~LiveSource() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void LiveSource::run() {
  auto pause = config_.first_pause;
  while (true) {
    Exposure wanted;
    std::uint64_t frames_before = 0;
    {
      const std::lock_guard lock(mutex_);
      if (ending_) return;
      wanted = wanted_;
      frames_before = status_.frames;
    }
    auto opened = open_(wanted);
    std::string why;
    if (opened) {
      std::shared_ptr<CameraStream> stream = std::move(*opened);
      {
        const std::lock_guard lock(mutex_);
        stream_ = stream;
      }
      why = take_frames(*stream);
    } else {
      why = opened.error().message;
    }
    lose(why);
    {
      const std::lock_guard lock(mutex_);
      if (ending_) return;
      if (status_.frames > frames_before) pause = config_.first_pause;
      if (opened) ++status_.restarts;
    }
    if (!rest(pause)) return;
    pause = std::min(2 * pause, config_.last_pause);
  }
}

std::string LiveSource::take_frames(CameraStream& stream) {
  auto last = steady_clock::now();
  while (true) {
    auto frame = stream.next(kPoll);
    {
      const std::lock_guard lock(mutex_);
      if (ending_) return "the source has ended";
    }
    if (!frame) return frame.error().message;
    if (*frame) {
      last = steady_clock::now();
      take(std::move(**frame));
    } else if (config_.trigger == CameraTrigger::free_running && steady_clock::now() - last > config_.stall) {
      return fmt::format("{}: no frame for {} ms", name_, config_.stall.count());
    }
  }
}

void LiveSource::take(RawFrame frame) {
  {
    const std::lock_guard lock(mutex_);
    status_.dropped += frame.missed + (frame.damaged ? 1 : 0);
    if (frame.damaged) return;
    ++status_.frames;
    if (!status_.fault.empty()) spdlog::info("{}: frames come", name_);
    status_.fault.clear();
    if (unsettled_frames_ > 0) {
      --unsettled_frames_;
      frame.exposure = {};
    }
    recent_.add(std::move(frame));
  }
  changed_.notify_all();
}

void LiveSource::lose(const std::string& why) {
  std::shared_ptr<CameraStream> gone;
  {
    const std::lock_guard lock(mutex_);
    if (status_.fault != why && !ending_) spdlog::error("{}", why);
    status_.fault = why;
    recent_.clear();
    gone = std::exchange(stream_, nullptr);
  }
  changed_.notify_all();
}

bool LiveSource::rest(milliseconds pause) {
  std::unique_lock lock(mutex_);
  return !changed_.wait_for(lock, pause, [this] { return ending_; });
}

Result<Frame> LiveSource::capture(const CaptureRequest& request) {
  const std::int64_t now_ns = wall_clock_ns();
  std::int64_t moment_ns = request.moment_ns == 0 ? now_ns : request.moment_ns;
  bool from_then_on = request.moment_ns == 0;
  std::vector<std::string> warnings;
  if (config_.trigger == CameraTrigger::software) {
    std::shared_ptr<CameraStream> stream;
    {
      const std::lock_guard lock(mutex_);
      stream = stream_;
      moment_ns = now_ns;
    }
    if (!stream) return job_failed("{}", status()->fault);
    if (auto fired = stream->fire(); !fired) return pass_on(fired.error());
    from_then_on = true;
  } else if (request.moment_ns != 0 && request.moment_ns < now_ns) {
    const std::lock_guard lock(mutex_);
    const auto oldest_ns = recent_.oldest_ns();
    if (oldest_ns && !recent_.reaches_back_to(moment_ns)) {
      warnings.push_back(fmt::format("{}: triggered for {:.0f} ms ago, its frames reach back {:.0f} ms; taken now",
                                     name_, milliseconds_of(now_ns - moment_ns), milliseconds_of(now_ns - *oldest_ns)));
      moment_ns = now_ns;
      from_then_on = true;
    }
  }
  const auto raw = wait_for_frame(moment_ns, from_then_on);
  if (!raw) return pass_on(raw.error());
  auto image = unpack(raw->layout, raw->bytes);
  if (!image) return job_failed("{}: {}", name_, image.error().message);
  Frame frame;
  frame.image = std::move(*image);
  frame.source = name_;
  frame.sensor_time_ns = raw->sensor_time_ns;
  frame.sequence = raw->sequence;
  frame.warnings = std::move(warnings);
  frame.exposure = raw->exposure;
  return frame;
}

Result<RawFrame> LiveSource::wait_for_frame(std::int64_t moment_ns, bool from_then_on) {
  const auto deadline = steady_clock::now() + config_.frame_wait;
  std::unique_lock lock(mutex_);
  while (true) {
    if (auto frame = from_then_on ? recent_.first_since(moment_ns) : recent_.nearest(moment_ns))
      return std::move(*frame);
    if (ending_) return job_failed("{}: ends", name_);
    if (changed_.wait_until(lock, deadline) == std::cv_status::timeout) break;
  }
  if (!status_.fault.empty()) return job_failed("{}", status_.fault);
  return job_failed("{}: no frame within {} ms of the trigger", name_, config_.frame_wait.count());
}

std::optional<CaptureStatus> LiveSource::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

Exposure LiveSource::exposure() const {
  const std::lock_guard lock(mutex_);
  return stream_ ? stream_->exposure() : wanted_;
}

Result<void> LiveSource::set_exposure(const Exposure& exposure) {
  std::shared_ptr<CameraStream> stream;
  {
    const std::lock_guard lock(mutex_);
    stream = stream_;
  }
  if (!stream) return job_failed("{}: cannot set its exposure now: {}", name_, status()->fault);
  if (auto set = stream->set_exposure(exposure); !set) return set;
  const std::lock_guard lock(mutex_);
  wanted_ = exposure;
  unsettled_frames_ = kFramesOnTheirWay;
  return {};
}

}  // namespace imprint
