#include "node/capture/live_source.h"

#include <condition_variable>
#include <deque>
#include <thread>

#include <catch2/catch.hpp>

#include "lib/clock/wall_clock.h"

namespace imprint {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr auto kPatience = std::chrono::seconds(10);  // of a busy machine; nothing waits for it when all is well
constexpr std::int64_t kMillisecondNs = 1'000'000;

/// A camera in the hands of the test.
class TestCamera {
 public:
  void give(RawFrame frame) { put(std::make_unique<RawFrame>(std::move(frame))); }
  void unplug() { put(nullptr); }

  /// A frame of one pixel.
  static RawFrame frame(std::int64_t time_ns, std::uint8_t value, std::uint64_t missed = 0, bool damaged = false) {
    auto pixel = std::make_shared<const std::uint8_t>(value);
    RawFrame frame;
    frame.layout = {PixelFormat::mono8, 1, 1, 0};
    frame.bytes = {pixel.get(), 1};
    frame.buffer = pixel;
    frame.sensor_time_ns = time_ns;
    frame.missed = missed;
    frame.damaged = damaged;
    frame.exposure = {500.0, 0.0};
    return frame;
  }

  OpenStream opener() {
    return [this](const Exposure& wanted) -> Result<std::unique_ptr<CameraStream>> {
      const std::lock_guard lock(mutex_);
      openings_.push_back(steady_clock::now());
      opened_with_ = wanted;
      changed_.notify_all();
      if (absent_) return job_failed("test camera: No such device");
      return std::make_unique<Stream>(*this);
    };
  }

  void set_absent(bool absent) {
    const std::lock_guard lock(mutex_);
    absent_ = absent;
  }
  void on_fire(std::function<void()> act) { fire_ = std::move(act); }

  std::vector<steady_clock::time_point> wait_for_openings(std::size_t count) {
    std::unique_lock lock(mutex_);
    REQUIRE(changed_.wait_for(lock, kPatience, [&] { return openings_.size() >= count; }));
    return openings_;
  }
  Exposure opened_with() {
    const std::lock_guard lock(mutex_);
    return opened_with_;
  }

 private:
  class Stream final : public CameraStream {
   public:
    explicit Stream(TestCamera& camera) : camera_(camera) {}
    Result<std::optional<RawFrame>> next(milliseconds timeout) override {
      std::unique_lock lock(camera_.mutex_);
      if (!camera_.changed_.wait_for(lock, timeout, [&] { return !camera_.frames_.empty(); })) return std::nullopt;
      auto frame = std::move(camera_.frames_.front());
      camera_.frames_.pop_front();
      if (!frame) return job_failed("test camera: lost");
      return std::move(*frame);
    }
    Result<void> set_exposure(const Exposure& exposure) override {
      if (exposure.gain_db != 0.0) return job_failed("test camera: no gain");
      const std::lock_guard lock(camera_.mutex_);
      exposure_ = exposure;
      return {};
    }
    [[nodiscard]] Exposure exposure() const override { return exposure_; }
    Result<void> fire() override {
      camera_.fire_();
      return {};
    }

   private:
    TestCamera& camera_;
    Exposure exposure_{500.0, 0.0};
  };

  void put(std::unique_ptr<RawFrame> frame) {
    {
      const std::lock_guard lock(mutex_);
      frames_.push_back(std::move(frame));
    }
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::unique_ptr<RawFrame>> frames_;  // none: unplugged
  std::vector<steady_clock::time_point> openings_;
  Exposure opened_with_;
  bool absent_ = false;
  std::function<void()> fire_ = [] {};
};

LiveConfig quick() {
  LiveConfig config;
  config.recent_frames = 3;
  config.frame_wait = kPatience;
  config.first_pause = milliseconds(10);
  config.last_pause = milliseconds(40);
  return config;
}

template <class Condition>
void wait_until(Condition condition) {
  const auto deadline = steady_clock::now() + kPatience;
  while (!condition()) {
    REQUIRE(steady_clock::now() < deadline);
    std::this_thread::sleep_for(milliseconds(1));
  }
}

int pixel(const Result<Frame>& frame) {
  REQUIRE(frame);
  return frame->image.at<std::uint8_t>(0, 0);
}

}  // namespace

TEST_CASE("live source: a trigger without a moment gets a frame taken after it, not one that was there") {
  TestCamera camera;
  LiveSource source("cam1", camera.opener(), quick());
  camera.give(TestCamera::frame(wall_clock_ns() - 50 * kMillisecondNs, 1));
  wait_until([&] { return source.status()->frames == 1; });
  std::thread later([&] {
    std::this_thread::sleep_for(milliseconds(20));
    camera.give(TestCamera::frame(wall_clock_ns() + 1000 * kMillisecondNs, 2));
  });
  CHECK(pixel(source.capture({"s", 0, 0.0, 0})) == 2);
  later.join();
}

TEST_CASE("live source: a trigger for a moment just past gets the frame of that moment") {
  TestCamera camera;
  LiveSource source("cam1", camera.opener(), quick());
  const std::int64_t now_ns = wall_clock_ns();
  for (int age = 3; age >= 0; --age)
    camera.give(TestCamera::frame(now_ns - 50 * age * kMillisecondNs, static_cast<std::uint8_t>(10 + age)));
  wait_until([&] { return source.status()->frames == 4; });
  const auto frame = source.capture({"s", 0, 0.0, now_ns - 95 * kMillisecondNs});
  CHECK(pixel(frame) == 12);
  CHECK(frame->warnings.empty());
  CHECK(frame->sensor_time_ns == now_ns - 100 * kMillisecondNs);
}

TEST_CASE("live source: a trigger for longer ago than its frames reach is served now and says so") {
  TestCamera camera;
  LiveSource source("cam1", camera.opener(), quick());
  camera.give(TestCamera::frame(wall_clock_ns(), 1));
  camera.give(TestCamera::frame(wall_clock_ns() + 5000 * kMillisecondNs, 2));
  wait_until([&] { return source.status()->frames == 2; });
  const auto frame = source.capture({"s", 0, 0.0, wall_clock_ns() - 60'000 * kMillisecondNs});
  CHECK(pixel(frame) == 2);
  REQUIRE(frame->warnings.size() == 1);
  CHECK_THAT(frame->warnings[0], Catch::Contains("cam1: triggered for 60") && Catch::Contains("taken now"));
}

TEST_CASE("live source: a camera that is lost is opened anew, after pauses that grow to a limit") {
  TestCamera camera;
  camera.set_absent(true);
  LiveSource source("cam1", camera.opener(), quick());
  const auto openings = camera.wait_for_openings(6);
  const auto pause = [&](std::size_t i) { return openings[i] - openings[i - 1]; };
  CHECK(pause(1) >= milliseconds(10));  // a pause is never shorter than meant; how much longer the machine decides
  CHECK(pause(2) >= milliseconds(20));
  CHECK(pause(3) >= milliseconds(40));
  CHECK(pause(5) >= milliseconds(40));
  CHECK(source.status()->fault == "test camera: No such device");
  CHECK(source.status()->restarts == 0);

  camera.set_absent(false);
  camera.give(TestCamera::frame(wall_clock_ns(), 1));
  wait_until([&] { return source.status()->frames == 1; });
  CHECK(source.status()->fault.empty());
  camera.unplug();
  wait_until([&] { return source.status()->restarts == 1; });
  camera.give(TestCamera::frame(wall_clock_ns() + 10'000 * kMillisecondNs, 3));
  CHECK(pixel(source.capture({})) == 3);
}

TEST_CASE("live source: a trigger of a camera that is lost fails with the reason, and in time") {
  TestCamera camera;
  camera.set_absent(true);
  LiveConfig config = quick();
  config.frame_wait = milliseconds(50);
  LiveSource source("cam1", camera.opener(), config);
  camera.wait_for_openings(2);
  const auto frame = source.capture({});
  REQUIRE_FALSE(frame);
  CHECK(frame.error().message == "test camera: No such device");
  CHECK(frame.error().exit_status() == 1);
}

TEST_CASE("live source: frames that never came and damaged ones are counted as dropped, and none is served") {
  TestCamera camera;
  LiveSource source("cam1", camera.opener(), quick());
  camera.give(TestCamera::frame(wall_clock_ns() + 1000 * kMillisecondNs, 1, 0, true));
  camera.give(TestCamera::frame(wall_clock_ns() + 2000 * kMillisecondNs, 2, 5));
  CHECK(pixel(source.capture({})) == 2);
  CHECK(source.status()->dropped == 6);
  CHECK(source.status()->frames == 1);
}

TEST_CASE("live source: a running camera that gives no frame is opened anew") {
  TestCamera camera;
  LiveConfig config = quick();
  config.stall = milliseconds(150);
  LiveSource source("cam1", camera.opener(), config);
  camera.wait_for_openings(2);
  CHECK_THAT(source.status()->fault, Catch::Contains("cam1: no frame for 150 ms"));
}

TEST_CASE("live source: software trigger takes the frame that follows its command") {
  TestCamera camera;
  LiveConfig config = quick();
  config.trigger = CameraTrigger::software;
  LiveSource source("cam1", camera.opener(), config);
  camera.give(TestCamera::frame(wall_clock_ns() - 1000 * kMillisecondNs, 1));
  wait_until([&] { return source.status()->frames == 1; });
  camera.on_fire([&] { camera.give(TestCamera::frame(wall_clock_ns() + kMillisecondNs, 7)); });
  CHECK(pixel(source.capture({})) == 7);
}

TEST_CASE("live source: an exposure holds over a loss, and frames on their way do not claim it") {
  TestCamera camera;
  LiveSource source("cam1", camera.opener(), quick());
  camera.give(TestCamera::frame(wall_clock_ns(), 1));
  wait_until([&] { return source.status()->frames == 1; });
  REQUIRE(source.adjustable_exposure() != nullptr);
  REQUIRE(source.adjustable_exposure()->set_exposure({2000.0, 0.0}));
  CHECK(source.adjustable_exposure()->exposure().time_us == 2000.0);
  for (int i = 1; i <= 3; ++i) {
    const std::int64_t time_ns = wall_clock_ns() + 10'000LL * i * kMillisecondNs;
    camera.give(TestCamera::frame(time_ns, 1));
    wait_until([&] { return source.status()->frames == static_cast<std::uint64_t>(1 + i); });
  }
  const auto on_its_way = source.capture({"s", 0, 0.0, wall_clock_ns() + 9'000 * kMillisecondNs});
  REQUIRE(on_its_way);
  CHECK(on_its_way->exposure.time_us == 0.0);
  const auto settled = source.capture({"s", 0, 0.0, wall_clock_ns() + 29'000 * kMillisecondNs});
  REQUIRE(settled);
  CHECK(settled->exposure.time_us == 500.0);  // as the camera says

  CHECK_FALSE(source.adjustable_exposure()->set_exposure({2000.0, 6.0}));
  camera.unplug();
  camera.wait_for_openings(2);
  CHECK(camera.opened_with().time_us == 2000.0);
}

}  // namespace imprint
