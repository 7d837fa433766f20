#include "fusion/fusion_service.h"

#include <algorithm>

#include "fusion/serve/query_answer.h"
#include "lib/clock/wall_clock.h"
#include "lib/log/log.h"

namespace imprint {
namespace {

constexpr std::size_t kMaxQueued = 2048;
constexpr std::size_t kMaxQueuedQueries = 64;
constexpr std::size_t kMaxMessageBytes = 16 * 1024;  // four times the largest imprint
constexpr std::size_t kMaxInOneGo = 256;             // messages before deadlines are looked at again
constexpr std::size_t kImprintHistory = 16;          // asked of each node on start; the rest is in its spool
constexpr std::size_t kTriggerHistory = 16;
constexpr std::size_t kMaxQueuedLiveness = 256;
constexpr int kResultFilesChecked = 100;
constexpr auto kIdleWait = std::chrono::seconds(1);
constexpr auto kRetryWait = std::chrono::milliseconds(500);

std::vector<std::string> camera_ids(const Rig& rig) {
  std::vector<std::string> ids;
  for (const CameraModel& camera : rig.cameras) ids.push_back(camera.id);
  return ids;
}

}  // namespace

FusionService::FusionService(FusionConfig config, Rig rig, Transport& transport, SessionStore& store, LineBoard& board,
                             Fuse fuse)
    : config_(std::move(config)),
      rig_(std::move(rig)),
      transport_(transport),
      store_(store),
      board_(board),
      fuse_(std::move(fuse)),
      assembler_(camera_ids(rig_), config_.assembler),
      rest_(config_.rest),
      queue_(std::make_shared<BoundedQueue<Message>>(kMaxQueued)),
      liveness_(std::make_shared<BoundedQueue<Message>>(kMaxQueuedLiveness)),
      queries_(std::make_shared<BoundedQueue<std::shared_ptr<Query>>>(kMaxQueuedQueries)) {}

Result<void> FusionService::start() {
  auto keys = Keys::of(config_.site, config_.line);
  if (!keys) return pass_on(keys.error());
  keys_ = std::make_shared<Keys>(std::move(*keys));
  auto desk = DeliveryDesk::open(transport_, *keys_, camera_ids(rig_), store_, board_);
  if (!desk) return pass_on(desk.error());
  desk_.emplace(std::move(*desk));
  announcer_.emplace(transport_, *keys_, config_.result_dir, board_);
  clocks_.emplace(transport_, *keys_, board_, config_.assembler.max_clock_offset_s);
  if (const auto latest = store_.latest_result(); latest && latest->has_value()) board_.set_result(**latest);
  if (auto subscribed = subscribe(); !subscribed) {
    declarations_.clear();
    return subscribed;
  }
  worker_ = std::thread([this] { work(); });
  answerer_ = std::thread([this] { answer_queries(); });
  return {};
}

Result<void> FusionService::subscribe() {
  auto trigger_publisher = transport_.publish(keys_->trigger(), {.traffic = Traffic::command, .history = 0});
  if (!trigger_publisher) return pass_on(trigger_publisher.error());
  trigger_publisher_ = std::move(*trigger_publisher);

  const auto on_miss = [this](std::string_view source, std::uint32_t count) {
    board_.count("missed", count);
    spdlog::warn("{} message(s) of {} were lost on the way", count, source);
  };
  const auto on_liveness = [queue = queue_, liveness = liveness_](std::string_view key, bool alive) {
    liveness->push({alive ? Kind::alive : Kind::gone, std::string(key), {}});
    queue->push({Kind::wake, {}, {}});  // a full queue needs no waking
  };
  const auto on_query = [queries = queries_](std::shared_ptr<Query> query) {
    if (!queries->push(query)) (void)query->reply_error("busy");
  };
  Result<std::unique_ptr<Declaration>> declared[] = {
      transport_.subscribe(keys_->trigger(), {.history = kTriggerHistory}, queueing(Kind::trigger), on_miss),
      transport_.subscribe(keys_->imprint(), {.history = kImprintHistory}, queueing(Kind::imprint), on_miss),
      transport_.subscribe(keys_->health(), {.history = 0}, queueing(Kind::health)),
      transport_.subscribe(keys_->delivery(), {.history = 0}, queueing(Kind::delivery)),
      transport_.subscribe(keys_->rest(), {.history = 0}, queueing(Kind::rest)),
      transport_.watch_liveness(keys_->alive(), on_liveness),
      transport_.answer(keys_->fusion_service("status"), on_query),
      transport_.answer(keys_->fusion_service("result"), on_query),
      transport_.announce(keys_->fusion_alive()),
  };
  for (auto& declaration : declared) {
    if (!declaration) return pass_on(declaration.error());
    declarations_.push_back(std::move(*declaration));
  }
  return {};
}

SampleCallback FusionService::queueing(Kind kind) {
  return [this, kind, queue = queue_](const Sample& sample) {
    if (sample.payload.size() > kMaxMessageBytes) {
      board_.count("malformed");
    } else if (!queue->push({kind, sample.key, sample.payload})) {
      board_.count("dropped");
    }
  };
}

void FusionService::stop() {
  if (stopping_.exchange(true)) return;
  declarations_.clear();  // nothing new comes in, then what is there is stored
  queue_->close();
  queries_->drop();
  if (worker_.joinable()) worker_.join();
  if (answerer_.joinable()) answerer_.join();
  clocks_.reset();
}

void FusionService::work() {
  // Only the newest of those that are merely not complete: what they still wait for may come.
  for (auto sessions : {store_.unevaluated(), store_.unfinished(static_cast<int>(config_.assembler.max_sessions))}) {
    if (!sessions) spdlog::error("{}", sessions.error().message);
    for (std::string& session : sessions.value_or(std::vector<std::string>{})) {
      if (std::ranges::find(backlog_, session) != backlog_.end()) continue;
      spdlog::info("session {}: not finished when this program last ended; taken up again", session);
      backlog_.push_back(std::move(session));
    }
  }
  if (const auto results = store_.sessions(kResultFilesChecked)) {  // ended between the database and the file
    for (const SessionSummary& summary : *results) {
      ++turns_;
      if (const auto result = store_.result(summary.session); result && result->has_value())
        announcer_->write_file(**result);
    }
  }
  while (!queue_->finished()) {
    ++turns_;
    take_up_backlog();
    evaluate();
    const Time idle_until = std::chrono::steady_clock::now() + kIdleWait;
    const bool more = !backlog_.empty() && assembler_.has_room();
    auto message = more ? queue_->try_pop()
                        : queue_->pop_until(std::min(assembler_.next_deadline().value_or(idle_until), idle_until));
    for (std::size_t i = 0; message && i < kMaxInOneGo; ++i) {
      handle(*message);
      message = queue_->try_pop();
    }
    if (message) handle(*message);
    while (const auto change = liveness_->try_pop()) handle(*change);
  }
  evaluate();
}

void FusionService::handle(const Message& message) {
  ++turns_;
  switch (message.kind) {
    case Kind::trigger:
      return receive_trigger(message);
    case Kind::imprint:
      return receive_imprint(message);
    case Kind::health:
      return receive_health(message);
    case Kind::delivery:
      return receive_delivery(message);
    case Kind::rest:
      return receive_rest(message);
    case Kind::wake:
      return;
    case Kind::alive:
    case Kind::gone:
      if (const auto camera = keys_->camera_of(message.key)) receive_liveness(*camera, message.kind == Kind::alive);
  }
}

void FusionService::receive_trigger(const Message& message) {
  const auto trigger = decode_trigger(message.bytes);
  if (!trigger) return malformed(message, trigger.error().message);
  if (const auto valid = check_id("session", trigger->session); !valid)
    return malformed(message, valid.error().message);
  if (const auto bounds = assembler_.check(*trigger); !bounds) return malformed(message, bounds.error().message);
  bool is_new = false;
  if (!surely<bool>([&] { return store_.add_trigger(*trigger, message.bytes, wall_clock_ns()); }, is_new)) return;
  spdlog::info("session {} observation {}: triggered{}, rotation {} deg", trigger->session, trigger->observation,
               is_new ? "" : " again", trigger->rotation_deg);
  if (assembler_.knows(trigger->session)) {
    (void)assembler_.add(*trigger, std::chrono::steady_clock::now());  // within bounds, as checked
  } else {
    recall(trigger->session);
  }
  show_session(trigger->session);
}

void FusionService::receive_imprint(const Message& message) {
  const auto imprint = decode_imprint(message.bytes);
  if (!imprint) return malformed(message, imprint.error().message);
  if (keys_->camera_of(message.key) != imprint->camera_id) {
    return malformed(message, fmt::format("carries an imprint of camera {}", imprint->camera_id));
  }
  if (const auto valid = check_id("session", imprint->session); !valid)
    return malformed(message, valid.error().message);
  const bool known = rig_.find_camera(imprint->camera_id) != nullptr;
  if (!known || imprint->observation >= config_.assembler.max_observations) {
    const std::string why =
        known ? fmt::format("a session has at most {} observations", config_.assembler.max_observations)
              : "the rig has no such camera";
    board_.count("refused");
    spdlog::warn("imprint of camera {} for session {} observation {} refused: {}", imprint->camera_id, imprint->session,
                 imprint->observation, why);
    if (known) desk_->refused(*imprint, why);  // a camera may still be added to the rig: its node keeps what it has
    return;
  }
  if (!assembler_.knows(imprint->session)) recall(imprint->session);
  const Time now = std::chrono::steady_clock::now();
  Circumstances circumstances{.late = assembler_.is_late(*imprint, now)};
  if (const auto offset = clocks_->offset(imprint->camera_id)) circumstances.clock_offset_ns = offset->offset_ns;
  bool is_new = false;
  if (!surely<bool>(
          [&] {
            return store_.add_imprint(*imprint, message.bytes,
                                      {wall_clock_ns(), circumstances.late, circumstances.clock_offset_ns});
          },
          is_new))
    return;
  board_.count(is_new ? "imprints" : "repeated");
  desk_->stored(*imprint, is_new);
  if (!is_new) return;
  if (circumstances.late) board_.count("late");
  board_.note_imprint(*imprint, now);
  const Arrival arrival = assembler_.add(*imprint, now, circumstances);
  if (arrival == Arrival::surplus) board_.count("surplus");
  spdlog::info("session {} observation {}: imprint of {} {}{}{}", imprint->session, imprint->observation,
               imprint->camera_id, arrival_name(arrival), circumstances.late ? ", late" : "",
               imprint->failure.empty() ? "" : "; it failed: " + imprint->failure);
  show_session(imprint->session);
}

void FusionService::receive_health(const Message& message) {
  const auto health = decode_health(message.bytes);
  if (!health) return malformed(message, health.error().message);
  if (keys_->camera_of(message.key) != health->camera_id) {
    return malformed(message, fmt::format("carries the health of camera {}", health->camera_id));
  }
  if (const auto raised = board_.set_health(*health, std::chrono::steady_clock::now())) spdlog::error("{}", *raised);
}

void FusionService::receive_delivery(const Message& message) {
  const auto delivery = decode_delivery(message.bytes);
  if (!delivery) return malformed(message, delivery.error().message);
  if (keys_->camera_of(message.key) != delivery->camera_id) {
    return malformed(message, fmt::format("carries the report of camera {}", delivery->camera_id));
  }
  desk_->receive(*delivery, std::chrono::steady_clock::now());
}

void FusionService::receive_rest(const Message& message) {
  const auto rest = decode_rest(message.bytes);
  if (!rest) return malformed(message, rest.error().message);
  if (keys_->camera_of(message.key) != rest->camera_id)
    return malformed(message, fmt::format("carries the word of camera {}", rest->camera_id));
  const auto trigger = rig_.find_camera(rest->camera_id) == nullptr
                           ? std::nullopt
                           : rest_.note(std::chrono::steady_clock::now(), wall_clock_ns());
  spdlog::info("camera {} sees the forging come to rest: {}", rest->camera_id,
               trigger               ? fmt::format("session {} observation {}", trigger->session, trigger->observation)
               : config_.rest.accept ? "already known"
                                     : "rest.accept is off, nothing is fired");
  if (!trigger) return;
  if (const auto fired = fire(*trigger); !fired) spdlog::error("not triggered: {}", fired.error().message);
}

void FusionService::receive_liveness(const std::string& camera_id, bool alive) {
  if (rig_.find_camera(camera_id) == nullptr) {
    if (alive) spdlog::warn("camera {} has connected, but the rig has no such camera", camera_id);
    return;
  }
  spdlog::info("camera {}: {}", camera_id, alive ? "connected" : "connection lost");
  assembler_.set_alive(camera_id, alive);
  clocks_->set_alive(camera_id, alive);
  board_.set_alive(camera_id, alive);
  if (!alive) return;
  for (Trigger trigger : assembler_.open_triggers(camera_id)) {
    trigger.fire_at_ns = 0;  // that moment has passed
    spdlog::info("session {} observation {}: trigger sent again for {}", trigger.session, trigger.observation,
                 camera_id);
    if (auto sent = trigger_publisher_->put(encode_trigger(trigger)); !sent) spdlog::warn("{}", sent.error().message);
  }
}

void FusionService::recall(const std::string& session) {
  ++turns_;
  const auto messages = store_.messages(session);
  if (!messages) {
    spdlog::error("session {}: {}", session, messages.error().message);
    return;
  }
  const Time now = std::chrono::steady_clock::now();
  const std::int64_t wall_now_ns = wall_clock_ns();
  // Older than the deadline is as good as the deadline; a clock that was set back makes nothing younger than now.
  const auto oldest_ns = static_cast<std::int64_t>(config_.assembler.deadline_s * 1e9);
  for (const StoredMessage& message : *messages) {
    const std::int64_t age_ns = std::clamp<std::int64_t>(wall_now_ns - message.reception.received_ns, 0, oldest_ns);
    const Time then = now - std::chrono::duration_cast<Time::duration>(std::chrono::nanoseconds(age_ns));
    if (message.is_trigger) {
      if (const auto trigger = decode_trigger(message.bytes)) (void)assembler_.add(*trigger, then);
    } else if (const auto imprint = decode_imprint(message.bytes)) {
      assembler_.add(*imprint, then, {message.reception.late, message.reception.clock_offset_ns});
    }
  }
}

void FusionService::evaluate() {
  for (const std::string& session : assembler_.settle(std::chrono::steady_clock::now())) make_result(session);
}

void FusionService::take_up_backlog() {
  for (std::string& session : assembler_.take_displaced()) backlog_.push_back(std::move(session));
  if (backlog_.empty() || !assembler_.has_room()) return;
  const std::string session = std::move(backlog_.front());
  backlog_.pop_front();
  if (assembler_.knows(session)) return;
  recall(session);
  show_session(session);
}

StoredResult FusionService::evaluated(const std::string& session) {
  StoredResult result;
  result.session = session;
  result.complete = assembler_.complete(session);
  result.made_ns = wall_clock_ns();
  try {
    auto measurement = fuse_(assembler_.observations(session), rig_.forging, session, config_.method);
    if (measurement) {
      const auto warnings = assembler_.warnings(session);
      measurement->warnings.insert(measurement->warnings.end(), warnings.begin(), warnings.end());
      measurement->line = config_.site + "/" + config_.line;
      measurement->made_at = utc_text(result.made_ns);
      result.json = to_json(*measurement).dump();
      // What was made again and is the same as before is the same result.
      if (const auto before = store_.result(session); before && before->has_value()) {
        measurement->made_at = utc_text((*before)->made_ns);
        if (auto again = to_json(*measurement).dump(); again == (*before)->json) result.json = std::move(again);
      }
    } else {
      result.error = measurement.error().message;
    }
  } catch (const std::exception& error) {  // a fault of ours or of a library must not end the line's only fusion
    result.json.clear();
    result.error = fmt::format("unexpected: {}", error.what());
  }
  return result;
}

void FusionService::make_result(const std::string& session) {
  ++turns_;
  StoredResult result = evaluated(session);
  const auto before = store_.revision(session);
  if (!surely<std::int64_t>([&] { return store_.put_result(result); }, result.revision)) return;
  if (before && *before == result.revision) {
    spdlog::info("session {}: made again, the same as result {}", session, result.revision);
  } else if (result.error.empty()) {
    spdlog::info("session {}: result {} stored, {}", session, result.revision,
                 result.complete ? "complete" : "not complete yet");
  } else {
    spdlog::warn("session {}: no measurement: {}", session, result.error);
  }
  if (!before || *before != result.revision) announcer_->announce(result);
  show_session(session);
}

void FusionService::show_session(const std::string& session) {
  board_.set_session({session, assembler_.expected(session), assembler_.complete(session), assembler_.states(session)});
}

void FusionService::malformed(const Message& message, const std::string& why) {
  board_.count("malformed");
  spdlog::warn("{}: message of {} bytes dropped: {}", message.key, message.bytes.size(), why);
}

template <class T>
bool FusionService::surely(const std::function<Result<T>()>& write, T& outcome) {
  for (bool alarmed = false;;) {
    if (auto done = write()) {
      if (alarmed) board_.set_alarm("store", "");
      outcome = *done;
      return true;
    } else if (!alarmed) {
      alarmed = true;
      board_.set_alarm("store", done.error().message);
      spdlog::error("{}; tried again until it succeeds", done.error().message);
    }
    if (stopping_) return false;
    ++turns_;  // a full disk is no hang: a restart would not help
    std::this_thread::sleep_for(kRetryWait);
  }
}

void FusionService::answer_queries() {
  while (auto query = queries_->pop()) {
    if (auto replied = answer_query(**query, *keys_, board_, store_); !replied)
      spdlog::warn("{}", replied.error().message);
  }
}

}  // namespace imprint
