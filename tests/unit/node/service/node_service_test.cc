#include "node/node_service.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <thread>

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using namespace std::chrono_literals;

// A camera that gives the pictures it is told to.
class FakeSource final : public FrameSource, public AdjustableExposure {
 public:
  Result<Frame> capture(const CaptureRequest& request) override {
    ++captures;
    if (request.observation == failing_observation) return job_failed("the lens cap is on");
    Frame frame;
    frame.sensor_time_ns = 42;
    frame.warnings = {"one channel of three"};
    if (adjustable) frame.exposure = exposure_;
    return frame;
  }
  AdjustableExposure* adjustable_exposure() override { return adjustable ? this : nullptr; }
  [[nodiscard]] Exposure exposure() const override { return exposure_; }
  Result<void> set_exposure(const Exposure& exposure) override {
    if (refuses) return job_failed("camera 7: no answer to the exposure");
    exposure_ = exposure;
    return {};
  }
  [[nodiscard]] std::optional<CaptureStatus> status() const override { return capture_status; }
  std::optional<CaptureStatus> capture_status;
  bool adjustable = false, refuses = false;
  std::atomic<int> failing_observation = -1;
  std::atomic<int> captures = 0;

 private:
  Exposure exposure_{1000.0, 0.0};
};

// Waits as long as a busy machine may need; true as soon as it is so.
bool soon(const std::function<bool()>& condition) {
  for (int i = 0; i < 2000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

// A node, and someone who listens, on one bus.
struct Line {
  std::shared_ptr<MemoryBus> bus = make_memory_bus();
  std::unique_ptr<Transport> node_side = open_memory(bus);
  std::unique_ptr<Transport> fusion_side = open_memory(bus);
  Keys keys = *Keys::of("plant", "L1");
  FakeSource source;
  std::mutex mutex;
  std::vector<Imprint> imprints;
  std::vector<Health> healths;
  std::vector<std::unique_ptr<Declaration>> declarations;
  std::unique_ptr<Publisher> triggers = *fusion_side->publish(keys.trigger(), {.traffic = Traffic::command});

  Line() {
    declarations.push_back(*fusion_side->subscribe(keys.imprint(), {}, [this](const Sample& sample) {
      const std::lock_guard lock(mutex);
      imprints.push_back(*decode_imprint(sample.payload));
    }));
    declarations.push_back(*fusion_side->subscribe(keys.health(), {}, [this](const Sample& sample) {
      const std::lock_guard lock(mutex);
      healths.push_back(*decode_health(sample.payload));
    }));
  }

  void fire(std::uint32_t observation, std::int64_t fire_at_ns = 0) {
    REQUIRE(triggers->put(encode_trigger({"S", observation, 30.0 * observation, fire_at_ns, 3})));
  }

  std::vector<Health> wait_for_healths(std::size_t count) {
    auto found = wait_for(healths, count);
    REQUIRE(found.size() >= count);
    return found;
  }
  std::vector<Imprint> wait_for_imprints(std::size_t count) { return wait_for(imprints, count); }

 private:
  // Those that have come, as soon as they are so many or the patience ends.
  template <class Message>
  std::vector<Message> wait_for(const std::vector<Message>& messages, std::size_t count) {
    soon([&] {
      const std::lock_guard lock(mutex);
      return messages.size() >= count;
    });
    const std::lock_guard lock(mutex);
    return messages;
  }
};

NodeConfig config() {
  NodeConfig config;
  config.camera_id = "cam1";
  config.method = "uniform";
  config.retry_s = 60.0;  // nobody gives receipts here; what is sent again would come between
  return config;
}

ProcessedFrame seen(const Frame& /*frame*/) {
  ProcessedFrame processed;
  processed.imprint.quality.targets_seen = 17;
  for (ImprintCurve* curve : {&processed.imprint.upper, &processed.imprint.lower, &processed.imprint.axis}) {
    curve->offset_px.assign(kImprintStations, 1.0);
    curve->weight.assign(kImprintStations, 1.0);
  }
  processed.imprint.focal_length_px = 5000.0;
  return processed;
}

}  // namespace

TEST_CASE("node: a trigger is answered by an imprint that carries what the trigger said") {
  Line line;
  NodeService node(config(), line.source, seen, *line.node_side);
  REQUIRE(node.start());
  line.fire(2);
  const auto imprints = line.wait_for_imprints(1);
  REQUIRE(imprints.size() == 1);
  REQUIRE(imprints[0].camera_id == "cam1");
  REQUIRE(imprints[0].session == "S");
  REQUIRE(imprints[0].observation == 2);
  REQUIRE(imprints[0].rotation_deg == 60.0);
  REQUIRE(imprints[0].sensor_time_ns == 42);
  REQUIRE(imprints[0].method == "uniform");
  REQUIRE(imprints[0].sequence == 1);
  REQUIRE(imprints[0].boot_id != 0);
  REQUIRE(imprints[0].warnings == std::vector<std::string>{"one channel of three"});
  REQUIRE(imprints[0].upper.offset_px.size() == kImprintStations);
}

TEST_CASE("node: a trigger that was answered well is not answered again, one that failed is") {
  Line line;
  line.source.failing_observation = 1;
  NodeService node(config(), line.source, seen, *line.node_side);
  REQUIRE(node.start());
  line.fire(0);
  line.fire(0);
  line.fire(1);
  REQUIRE(line.wait_for_imprints(2).size() == 2);
  line.source.failing_observation = -1;
  line.fire(0);
  line.fire(1);
  const auto imprints = line.wait_for_imprints(3);
  REQUIRE(imprints.size() == 3);
  REQUIRE(imprints[1].observation == 1);
  REQUIRE(imprints[1].failure == "the lens cap is on");
  REQUIRE(imprints[2].observation == 1);
  REQUIRE(imprints[2].failure.empty());
  REQUIRE(imprints[2].sequence == 3);
  REQUIRE(line.source.captures == 3);
}

TEST_CASE("node: what was answered before a restart and still waits for fusion is sent, not taken again") {
  const TemporaryFolder folder;
  Line line;
  NodeConfig settings = config();
  settings.data_dir = folder.path();
  {
    NodeService node(settings, line.source, seen, *line.node_side);
    REQUIRE(node.start());
    line.fire(0);
    REQUIRE(line.wait_for_imprints(1).size() == 1);
  }
  NodeService node(settings, line.source, seen, *line.node_side);
  REQUIRE(node.start());
  line.fire(0);
  line.fire(1);
  const auto imprints = line.wait_for_imprints(2);
  REQUIRE(imprints.back().observation == 1);
  REQUIRE(line.source.captures == 2);
  const auto fusion = line.fusion_side->announce(line.keys.fusion_alive());
  REQUIRE(line.wait_for_imprints(3).size() >= 3);  // fusion has come: the first is sent again
}

TEST_CASE("node: an exception of a stage fails the frame, not the node") {
  Line line;
  bool first = true;
  NodeService node(
      config(), line.source,
      [&](const Frame& frame) {
        if (std::exchange(first, false)) throw std::runtime_error("out of memory");
        return seen(frame);
      },
      *line.node_side);
  REQUIRE(node.start());
  line.fire(0);
  line.fire(1);
  const auto imprints = line.wait_for_imprints(2);
  REQUIRE(imprints.size() == 2);
  REQUIRE(imprints[0].failure.find("out of memory") != std::string::npos);
  REQUIRE(imprints[1].failure.empty());
}

TEST_CASE("node: health is sent on start and after every frame, with the last error in at most 80 characters") {
  Line line;
  line.source.failing_observation = 1;
  NodeService node(
      config(), line.source,
      [](const Frame& frame) {
        auto processed = seen(frame);
        processed.imprint.failure = std::string(79, 'x') + "\xC3\xA4tail";  // the cut falls inside a character
        return processed;
      },
      *line.node_side);
  REQUIRE(node.start());
  line.fire(0);
  REQUIRE(line.wait_for_imprints(1).size() == 1);
  const auto healths = line.wait_for_healths(2);
  REQUIRE(healths.front().frames == 0);
  REQUIRE(healths.back().frames == 1);
  REQUIRE(healths.back().failed_frames == 1);
  REQUIRE(healths.back().targets_seen == 17);
  REQUIRE(healths.back().sequence == 1);
  REQUIRE(healths.back().last_error == std::string(79, 'x'));
}

// The imprints and the last health of frames that show a body of `level` at 1000 us.
struct ExposureRun {
  std::vector<Imprint> imprints;
  Health health;
};

ExposureRun expose(Line& line, const NodeConfig& config, double level, std::uint32_t frames) {
  NodeService node(
      config, line.source,
      [&](const Frame& frame) {
        auto processed = seen(frame);
        const double time_us = frame.exposure.time_us > 0 ? frame.exposure.time_us : 1000.0;
        processed.imprint.quality.body_level = std::min(1.0, level * time_us / 1000.0);
        processed.imprint.quality.saturated_fraction = processed.imprint.quality.body_level >= 1.0 ? 0.9 : 0.0;
        return processed;
      },
      *line.node_side);
  REQUIRE(node.start());
  for (std::uint32_t i = 0; i < frames; ++i) line.fire(i);
  auto imprints = line.wait_for_imprints(frames);
  REQUIRE(imprints.size() == frames);
  node.stop();
  return {std::move(imprints), line.wait_for_healths(frames + 1).back()};  // the bus delivers on a thread of its own
}

TEST_CASE("node: a body that saturates is exposed less the next time; where that is at its end, health says so") {
  Line line;
  line.source.adjustable = true;
  SECTION("it comes out of saturation") {
    const auto run = expose(line, config(), 3.0, 3);
    REQUIRE(run.imprints[0].quality.body_level == 1.0);
    REQUIRE(run.imprints[2].quality.body_level == Approx(0.75));
    REQUIRE(run.health.exposure_us == Approx(250.0));
    REQUIRE(run.health.exposure_alarm.empty());
  }
  SECTION("it cannot") {
    auto limited = config();
    limited.exposure.min_time_us = 500.0;
    const auto run = expose(line, limited, 3.0, 3);
    const std::string alarm = "cannot hold the body out of saturation: exposure at its minimum 500 us";
    REQUIRE(run.health.exposure_us == Approx(500.0));
    REQUIRE(run.health.exposure_alarm == alarm);
    REQUIRE(run.imprints[2].warnings.front() == "camera \"cam1\": " + alarm);
  }
  SECTION("the camera does not take it") {
    line.source.refuses = true;
    REQUIRE(expose(line, config(), 3.0, 1).health.exposure_alarm == "camera 7: no answer to the exposure");
  }
}

TEST_CASE("node: a source whose exposure cannot be set, or must not, is left alone; that it saturates is told") {
  Line line;
  REQUIRE(expose(line, config(), 3.0, 1).health.exposure_alarm ==
          "cannot hold the body out of saturation: the exposure of this frame source cannot be set");
  Line other;
  other.source.adjustable = true;
  auto off = config();
  off.exposure.automatic = false;
  const auto run = expose(other, off, 3.0, 2);
  REQUIRE(run.health.exposure_us == 1000.0);
  REQUIRE(run.health.exposure_alarm == "cannot hold the body out of saturation: exposure.auto is off");
  Line good;
  REQUIRE(expose(good, config(), 0.8, 1).health.exposure_alarm.empty());
}

TEST_CASE("node: a trigger fires at its moment; one of clocks that disagree fires at once with a warning") {
  Line line;
  NodeService node(config(), line.source, seen, *line.node_side);
  REQUIRE(node.start());
  const auto begin = std::chrono::steady_clock::now();
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  line.fire(0, std::chrono::duration_cast<std::chrono::nanoseconds>(now + 300ms).count());
  REQUIRE(line.wait_for_imprints(1).size() == 1);
  REQUIRE(std::chrono::steady_clock::now() - begin > 290ms);  // the two clocks may run a little apart
  line.fire(1, std::chrono::duration_cast<std::chrono::nanoseconds>(now + 1h).count());
  const auto imprints = line.wait_for_imprints(2);
  REQUIRE(imprints.size() == 2);
  REQUIRE(imprints[1].warnings.back().find("check the clocks") != std::string::npos);
}

TEST_CASE("node: it tells its time, and fires by fusion's clock once it knows the difference") {
  Line line;
  NodeService node(config(), line.source, seen, *line.node_side);
  REQUIRE(node.start());
  const auto now_ns = [] {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
        .count();
  };
  const std::int64_t hour_ns = 3'600'000'000'000;  // as if this node were an hour ahead
  const std::int64_t before_ns = now_ns();
  const auto replies = line.fusion_side->get(line.keys.service("cam1", "clock"), encode_clock_question({hour_ns}), 5s);
  REQUIRE(replies);
  REQUIRE(replies->size() == 1);
  const auto reading = decode_clock_reading(replies->front().payload);
  REQUIRE(reading);
  REQUIRE(reading->received_ns >= before_ns);
  REQUIRE(reading->sent_ns >= reading->received_ns);
  REQUIRE(reading->sent_ns <= now_ns());
  const auto begin = std::chrono::steady_clock::now();
  line.fire(0, now_ns() - hour_ns + 300'000'000);  // in 0.3 s by fusion's clock
  REQUIRE(line.wait_for_imprints(1).size() == 1);
  REQUIRE(std::chrono::steady_clock::now() - begin > 250ms);
  REQUIRE(line.wait_for_imprints(1)[0].warnings.size() == 1);  // that of the picture alone
}

TEST_CASE("node: it stops at once while it waits for a trigger's moment, and malformed triggers change nothing") {
  Line line;
  NodeService node(config(), line.source, seen, *line.node_side);
  REQUIRE(node.start());
  REQUIRE(line.triggers->put(Bytes{0xFF, 0xFF, 0xFF}));
  REQUIRE(line.triggers->put(Bytes(1'000'000, 0)));
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  line.fire(0, std::chrono::duration_cast<std::chrono::nanoseconds>(now + 30s).count());
  std::this_thread::sleep_for(50ms);
  const auto begin = std::chrono::steady_clock::now();
  node.stop();
  REQUIRE(std::chrono::steady_clock::now() - begin < 2s);
  REQUIRE(line.source.captures == 0);
}

TEST_CASE("node: what it says of itself is good until a frame shows no targets or its camera is lost") {
  Line line;
  line.source.failing_observation = 1;
  NodeService node(config(), line.source, seen, *line.node_side);
  REQUIRE(node.start());
  CHECK(node.condition() == "good: no trigger yet");
  line.fire(0);
  REQUIRE(line.wait_for_imprints(1).size() == 1);
  line.wait_for_healths(2);
  CHECK(node.condition() == "good: 17 targets in the last of 1 frames");
  line.fire(1);
  REQUIRE(line.wait_for_imprints(2).size() == 2);
  line.wait_for_healths(3);
  CHECK(node.condition() == "no targets in the last frame: the lens cap is on");
}

TEST_CASE("node: what its camera lost, and why it gives no frames, is in health") {
  Line line;
  line.source.capture_status = CaptureStatus{10, 3, 2, "/dev/video0: lost: No such device"};
  NodeService node(config(), line.source, seen, *line.node_side);
  REQUIRE(node.start());
  const Health health = line.wait_for_healths(1).back();
  CHECK(health.dropped_frames == 3);
  CHECK(health.capture_restarts == 2);
  CHECK(health.capture_fault == "/dev/video0: lost: No such device");
  CHECK(node.condition() == "no frames: /dev/video0: lost: No such device");
}

TEST_CASE("node: its token is there while it runs and gone when it has stopped") {
  Line line;
  std::mutex mutex;
  std::vector<std::pair<std::string, bool>> changes;
  auto watch = line.fusion_side->watch_liveness(line.keys.alive(), [&](std::string_view key, bool alive) {
    const std::lock_guard lock(mutex);
    changes.emplace_back(key, alive);
  });
  REQUIRE(watch);
  {
    NodeService node(config(), line.source, seen, *line.node_side);
    REQUIRE(node.start());
  }
  REQUIRE(soon([&] {
    const std::lock_guard lock(mutex);
    return changes.size() >= 2;
  }));
  const std::lock_guard lock(mutex);
  REQUIRE(changes ==
          std::vector<std::pair<std::string, bool>>{{line.keys.alive("cam1"), true}, {line.keys.alive("cam1"), false}});
}

TEST_CASE("node: a forging that comes to rest is told to fusion once; triggers are answered meanwhile") {
  Line line;
  std::atomic<int> told = 0;
  line.declarations.push_back(*line.fusion_side->subscribe(line.keys.rest(), {}, [&](const Sample& sample) {
    const auto rest = decode_rest(sample.payload);
    if (rest && rest->camera_id == "cam1" && line.keys.camera_of(sample.key) == "cam1") ++told;
  }));
  std::atomic<bool> there = false;
  const auto see = [&](const Frame& /*frame*/) -> std::optional<Segmentation> {
    if (!there) return std::nullopt;
    Segmentation forging;
    forging.upper_offset_px.assign(600, -80.0F);
    forging.lower_offset_px.assign(600, 80.0F);
    return forging;
  };
  NodeConfig watching = config();
  watching.rest = {.trigger = true, .period_ms = 20.0, .max_motion_px = 2.0, .hold_s = 0.1, .rearm_px = 12.0};
  NodeService node(watching, line.source, seen, *line.node_side, see);
  REQUIRE(node.start());
  REQUIRE(soon([&] { return line.source.captures > 10; }));
  REQUIRE(told == 0);  // an empty hall rests, but there is nothing to measure
  there = true;
  REQUIRE(soon([&] { return told > 0; }));
  line.fire(0);
  REQUIRE(line.wait_for_imprints(1).size() == 1);
  std::this_thread::sleep_for(300ms);
  REQUIRE(told == 1);
}

TEST_CASE("node: without rest.trigger no frame is taken but when triggered") {
  Line line;
  NodeService node(config(), line.source, seen, *line.node_side,
                   [](const Frame& /*frame*/) { return std::optional<Segmentation>(); });
  REQUIRE(node.start());
  std::this_thread::sleep_for(200ms);
  REQUIRE(line.source.captures == 0);
}

}  // namespace imprint
