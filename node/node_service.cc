#include "node/node_service.h"

#include <algorithm>

#include "lib/clock/wall_clock.h"
#include "lib/log/log.h"
#include "lib/wire/keys.h"
#include "node/capture/exposure_control.h"

namespace imprint {
namespace {

using std::chrono::steady_clock;

constexpr std::size_t kMaxQueuedTriggers = 64;
constexpr std::size_t kMaxTriggerBytes = 4096;
constexpr std::size_t kRememberedAnswers = 1024;
constexpr std::size_t kMaxErrorBytes = 80;           // of the health record
constexpr auto kMaxLead = std::chrono::seconds(60);  // a moment further ahead means clocks that disagree

// Not in the middle of a UTF-8 character.
std::string cut(std::string text, std::size_t max_bytes) {
  if (text.size() <= max_bytes) return text;
  while (max_bytes > 0 && (static_cast<unsigned char>(text[max_bytes]) & 0xC0U) == 0x80U) --max_bytes;
  text.resize(max_bytes);
  return text;
}

std::int64_t nanoseconds(auto duration) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
}

// Says since when the worker has been at one piece of work.
class Busy {
 public:
  explicit Busy(std::atomic<std::int64_t>& since_ns) : since_ns_(since_ns) {
    since_ns_ = nanoseconds(steady_clock::now().time_since_epoch());
  }
  ~Busy() { since_ns_ = 0; }
  Busy(const Busy&) = delete;
  Busy& operator=(const Busy&) = delete;

 private:
  std::atomic<std::int64_t>& since_ns_;
};

}  // namespace

NodeService::NodeService(NodeConfig config, FrameSource& source, ProcessFrame process, Transport& transport,
                         SeeForging see)
    : config_(std::move(config)),
      source_(source),
      process_(std::move(process)),
      see_(std::move(see)),
      transport_(transport),
      triggers_(std::make_shared<BoundedQueue<Bytes>>(kMaxQueuedTriggers)),
      rest_(config_.rest) {
  health_.camera_id = config_.camera_id;
  health_.version = IMPRINT_VERSION;
}

Result<void> NodeService::start() {
  const auto keys = Keys::of(config_.site, config_.line);
  if (!keys) return pass_on(keys.error());
  health_.boot_id = make_boot_id();
  housing_ = Thermometer::open(config_.housing_temperature).value_or(Thermometer{});
  sensor_ = Thermometer::open(config_.sensor_temperature).value_or(Thermometer{});
  auto spool = ImprintSpool::open(config_.data_dir.empty() ? config_.data_dir : config_.data_dir / config_.camera_id,
                                  static_cast<std::size_t>(config_.spool_max_mb) << 20U);
  if (!spool) return pass_on(spool.error());
  auto courier = ImprintCourier::start(transport_, *keys, config_.camera_id, health_.boot_id, std::move(*spool),
                                       {.first_timeout_s = config_.retry_s});
  if (!courier) return pass_on(courier.error());
  courier_ = std::move(*courier);
  for (auto& answer : courier_->answered_before()) {
    if (answered_.size() >= kRememberedAnswers) answered_.pop_front();
    answered_.push_back(std::move(answer));
  }
  auto clock = ClockAnswer::start(transport_, *keys, config_.camera_id);
  if (!clock) return pass_on(clock.error());
  clock_ = std::move(*clock);
  auto health = transport_.publish(keys->health(config_.camera_id), {.traffic = Traffic::health, .history = 0});
  if (!health) return pass_on(health.error());
  health_publisher_ = std::move(*health);

  if (config_.rest.trigger && see_) {
    auto rest = transport_.publish(keys->rest(config_.camera_id), {.traffic = Traffic::command, .history = 0});
    if (!rest) return pass_on(rest.error());
    rest_publisher_ = std::move(*rest);
  }

  auto subscribed = transport_.subscribe(keys->trigger(), {.history = 0}, [queue = triggers_](const Sample& sample) {
    if (sample.payload.size() > kMaxTriggerBytes || !queue->push(sample.payload)) {
      spdlog::error("{}: trigger of {} bytes dropped: too large, or more than {} are waiting", sample.key,
                    sample.payload.size(), kMaxQueuedTriggers);
    }
  });
  if (!subscribed) return pass_on(subscribed.error());
  declarations_.push_back(std::move(*subscribed));

  worker_ = std::thread([this] { work(); });

  // Last: who sees this token may trigger.
  auto token = transport_.announce(keys->alive(config_.camera_id));
  if (!token) return pass_on(token.error());
  declarations_.push_back(std::move(*token));
  send_health();
  return {};
}

void NodeService::stop() {
  {
    const std::lock_guard lock(stop_mutex_);
    if (std::exchange(stopping_, true)) return;
  }
  stop_changed_.notify_all();
  triggers_->drop();
  if (worker_.joinable()) worker_.join();
  declarations_.clear();
}

bool NodeService::stuck(std::chrono::seconds limit) const {
  const std::int64_t since_ns = busy_since_ns_;
  return since_ns != 0 && nanoseconds(steady_clock::now().time_since_epoch()) - since_ns > nanoseconds(limit);
}

std::string NodeService::condition() {
  const std::lock_guard lock(health_mutex_);
  if (!health_.capture_fault.empty()) return "no frames: " + health_.capture_fault;
  if (health_.frames == 0) return "good: no trigger yet";
  if (health_.targets_seen == 0) return "no targets in the last frame: " + health_.last_error;
  return fmt::format("good: {} targets in the last of {} frames", health_.targets_seen, health_.frames);
}

void NodeService::work() {
  if (!rest_publisher_) {
    while (const auto message = triggers_->pop()) receive(*message);
    return;
  }
  const auto period = std::chrono::duration_cast<steady_clock::duration>(
      std::chrono::duration<double, std::milli>(config_.rest.period_ms));
  while (!triggers_->finished()) {
    const auto message = triggers_->pop_until(steady_clock::now() + period);
    if (message)
      receive(*message);
    else if (!triggers_->finished())
      look();
  }
}

void NodeService::look() {
  const Busy busy(busy_since_ns_);
  std::optional<Segmentation> forging;
  try {
    if (const auto frame = source_.capture(next_request_)) {
      forging = see_(*frame);
    } else {
      spdlog::debug("rest: {}", frame.error().message);
    }
  } catch (const std::exception& error) {  // as in make_imprint()
    spdlog::warn("rest: unexpected: {}", error.what());
  }
  if (!rest_.note(forging, steady_clock::now())) return;
  spdlog::info("the forging has come to rest: fusion is asked for an observation");
  if (const auto asked = rest_publisher_->put(encode_rest({config_.camera_id, wall_clock_ns()})); !asked)
    spdlog::error("fusion could not be asked for an observation: {}", asked.error().message);
}

void NodeService::receive(const Bytes& message) {
  const auto trigger = decode_trigger(message);
  if (!trigger) {
    spdlog::warn("trigger of {} bytes dropped: {}", message.size(), trigger.error().message);
    return;
  }
  const std::pair answer(trigger->session, trigger->observation);
  if (std::ranges::find(answered_, answer) != answered_.end()) {
    spdlog::debug("session {} observation {}: already answered", trigger->session, trigger->observation);
    return;
  }
  std::vector<std::string> warnings;
  if (!await(*trigger, warnings)) return;

  Imprint imprint = [&] {
    const Busy busy(busy_since_ns_);
    return make_imprint(*trigger);
  }();
  const bool last = trigger->observation + 1 == trigger->observations_expected;
  next_request_ = {trigger->session, last ? 0 : static_cast<int>(trigger->observation) + 1, trigger->rotation_deg};
  imprint.warnings.insert(imprint.warnings.end(), warnings.begin(), warnings.end());
  if (imprint.failure.empty()) {
    if (answered_.size() >= kRememberedAnswers) answered_.pop_front();
    answered_.push_back(answer);
  }
  note(imprint);
}

bool NodeService::await(const Trigger& trigger, std::vector<std::string>& warnings) {
  const auto lead = std::chrono::nanoseconds(trigger.fire_at_ns - (wall_clock_ns() - clock_->offset_ns()));
  std::unique_lock lock(stop_mutex_);
  if (trigger.fire_at_ns == 0 || lead <= std::chrono::nanoseconds(0)) return !stopping_;
  if (lead > kMaxLead) {
    warnings.push_back(fmt::format("triggered for {} s from now; fired at once, check the clocks",
                                   std::chrono::duration_cast<std::chrono::seconds>(lead).count()));
    return !stopping_;
  }
  return !stop_changed_.wait_for(lock, lead, [this] { return stopping_; });
}

std::int64_t NodeService::moment_of(const Trigger& trigger) const {
  if (trigger.fire_at_ns == 0) return 0;
  const std::int64_t moment_ns = trigger.fire_at_ns + clock_->offset_ns();
  return moment_ns > wall_clock_ns() ? 0 : moment_ns;  // still ahead: was too far ahead to be waited for
}

Imprint NodeService::make_imprint(const Trigger& trigger) {
  Imprint imprint;
  std::int64_t sensor_time_ns = wall_clock_ns();
  try {
    auto frame = source_.capture(
        {trigger.session, static_cast<int>(trigger.observation), trigger.rotation_deg, moment_of(trigger)});
    if (frame) {
      if (frame->sensor_time_ns == 0) frame->sensor_time_ns = sensor_time_ns;
      sensor_time_ns = frame->sensor_time_ns;
      ProcessedFrame processed = process_(*frame);
      imprint = std::move(processed.imprint);
      if (processed.error && imprint.failure.empty()) imprint.failure = processed.error->message;
      imprint.warnings.insert(imprint.warnings.end(), frame->warnings.begin(), frame->warnings.end());
      control_exposure(*frame, imprint);
    } else {
      imprint.failure = frame.error().message;
    }
  } catch (const std::exception& error) {  // a fault of ours or of a library: this frame fails, the node goes on
    imprint = {};
    imprint.failure = fmt::format("unexpected: {}", error.what());
  }
  imprint.camera_id = config_.camera_id;
  imprint.session = trigger.session;
  imprint.observation = trigger.observation;
  imprint.rotation_deg = trigger.rotation_deg;
  imprint.sensor_time_ns = sensor_time_ns;
  imprint.method = config_.method;
  return imprint;
}

void NodeService::control_exposure(const Frame& frame, Imprint& imprint) {
  const BodyLight light{imprint.quality.body_level, imprint.quality.saturated_fraction};
  AdjustableExposure* camera = config_.exposure.automatic ? source_.adjustable_exposure() : nullptr;
  std::string alarm;
  if (camera != nullptr) {
    const ExposureDecision decision = next_exposure(config_.exposure, frame.exposure, light);
    alarm = decision.alarm;
    if (decision.changed) {
      const auto set = camera->set_exposure(decision.next);
      if (!set) alarm = set.error().message;
      if (set) spdlog::info("exposure {:.4g} us, {:.1f} dB from now on", decision.next.time_us, decision.next.gain_db);
    }
  } else if (is_saturated(light)) {
    alarm = fmt::format(
        "cannot hold the body out of saturation: {}",
        config_.exposure.automatic ? "the exposure of this frame source cannot be set" : "exposure.auto is off");
  }
  if (!alarm.empty())  // first: only three warnings are sure to be sent
    imprint.warnings.insert(imprint.warnings.begin(), fmt::format("camera \"{}\": {}", config_.camera_id, alarm));
  const std::lock_guard lock(health_mutex_);
  if (alarm != health_.exposure_alarm && !alarm.empty()) spdlog::error("{}", alarm);
  health_.exposure_alarm = alarm;
  health_.exposure_us = frame.exposure.time_us;
  health_.gain_db = frame.exposure.gain_db;
}

void NodeService::note(const Imprint& imprint) {
  courier_->send(imprint);
  {
    const std::lock_guard lock(health_mutex_);
    ++health_.frames;
    if (!imprint.failure.empty()) ++health_.failed_frames;
    health_.last_error = cut(imprint.failure, kMaxErrorBytes);
    health_.targets_seen = imprint.quality.targets_seen;
    health_.reprojection_rms_px = imprint.quality.reprojection_rms_px;
    health_.contrast = imprint.quality.contrast;
    health_.saturated_fraction = imprint.quality.saturated_fraction;
    health_.body_level = imprint.quality.body_level;
    health_.blur_px = imprint.quality.blur_px;
    health_.haze_px = imprint.quality.haze_px;
    health_.pose_state = imprint.pose_state;
  }
  if (imprint.failure.empty()) {
    spdlog::info("session {} observation {}: imprint sent, {} targets, reprojection rms {:.3f} px, coverage {:.0f} %",
                 imprint.session, imprint.observation, imprint.quality.targets_used,
                 imprint.quality.reprojection_rms_px, 100.0 * imprint.quality.edge_coverage);
  } else {
    spdlog::warn("session {} observation {}: no imprint: {}", imprint.session, imprint.observation, imprint.failure);
  }
  send_health();
}

void NodeService::read_board() {
  health_.housing_temperature_c = housing_.read();
  health_.sensor_temperature_c = sensor_.read();
  health_.clock_offset_s = clock_ ? std::optional(1e-9 * static_cast<double>(clock_->offset_ns())) : std::nullopt;
  if (const auto capture = source_.status()) {
    health_.dropped_frames = capture->dropped;
    health_.capture_restarts = capture->restarts;
    health_.capture_fault = cut(capture->fault, kMaxErrorBytes);
  }
  health_.storage_free_mb.reset();
  std::error_code failed;
  const auto space = std::filesystem::space(config_.data_dir, failed);
  if (!config_.data_dir.empty() && !failed) health_.storage_free_mb = 1e-6 * static_cast<double>(space.available);
}

void NodeService::send_health() {
  if (!courier_ || !health_publisher_) return;
  {
    const std::lock_guard lock(health_mutex_);
    health_.time_ns = wall_clock_ns();
    health_.sequence = courier_->sequence();
    read_board();
    if (auto sent = health_publisher_->put(encode_health(health_)); !sent)
      spdlog::warn("health not sent: {}", sent.error().message);
  }
  courier_->report();
}

}  // namespace imprint
