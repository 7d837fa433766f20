#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <iostream>
#include <mutex>
#include <optional>
#include <set>

#include "cli/command.h"
#include "cli/command_line.h"
#include "cli/line_link.h"
#include "cli/result_table.h"
#include "fusion/results/measurement.h"
#include "lib/clock/wall_clock.h"
#include "lib/daemon/bounded_queue.h"
#include "lib/daemon/stop_signal.h"
#include "lib/wire/wire.h"

namespace imprint {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr auto kStatusTimeout = milliseconds(5000);
constexpr auto kAskTimeout = milliseconds(2000);
constexpr auto kPoll = milliseconds(200);
constexpr std::size_t kMaxQueuedEvents = 4096;

milliseconds to_milliseconds(double seconds) { return milliseconds(static_cast<std::int64_t>(seconds * 1000.0)); }

std::string joined(const json& names) {
  std::string text;
  for (const json& name : names) text.append(text.empty() ? "" : ", ").append(name.get<std::string>());
  return text;
}

// ---- status

void print_camera(const json& camera) {
  std::cout << fmt::format("  {:<12} {:<14}", camera["id"].get<std::string>(),
                           camera["alive"].get<bool>() ? "connected" : "NOT CONNECTED");
  if (const json& health = camera["health"]; health.is_object() && health["frames"] == 0) {
    std::cout << fmt::format("no frame taken yet, heard {:.0f} s ago", health["age_s"].get<double>());
  } else if (health.is_object()) {
    std::cout << fmt::format("{:>3} targets, reprojection rms {:.3f} px, {} frames ({} failed), heard {:.0f} s ago",
                             health["targets_seen"].get<int>(), health["reprojection_rms_px"].get<double>(),
                             health["frames"].get<std::uint64_t>(), health["failed_frames"].get<std::uint64_t>(),
                             health["age_s"].get<double>());
    if (const auto error = health["last_error"].get<std::string>(); !error.empty())
      std::cout << "; last error: " << error;
  }
  if (const json& clock = camera["clock"]; clock.is_object())
    std::cout << fmt::format("; clock {:+.3f} s", clock["offset_s"].get<double>());
  if (const json& delivery = camera["delivery"]; delivery.is_object()) {
    if (delivery["missing"] != 0)
      std::cout << "; MISSING imprint(s) number " << delivery["missing_numbers"].get<std::string>();
    if (const json& node = delivery["node"]; node.is_object() && node["waiting"] != 0)
      std::cout << fmt::format("; {} imprint(s) wait in the node", node["waiting"].get<int>());
  }
  std::cout << '\n';
}

void print_status(const json& status) {
  std::cout << fmt::format("fusion of {}/{}, version {}, up {:.0f} s\n", status["site"].get<std::string>(),
                           status["line"].get<std::string>(), status["version"].get<std::string>(),
                           status["uptime_s"].get<double>());
  for (const json& camera : status["cameras"]) print_camera(camera);
  if (const json& session = status["session"]; session.is_object()) {
    const auto settled =
        std::ranges::count_if(session["observations"], [](const json& o) { return o["settled"].get<bool>(); });
    const int expected = session["observations_expected"].get<int>();
    std::cout << fmt::format("session {}: {} {}, {}\n", session["session"].get<std::string>(), settled,
                             expected > 0 ? fmt::format("of {} observations in", expected)
                                          : "observations in, their number not stated (trigger --expect)",
                             session["complete"].get<bool>() ? "complete" : "not complete");
  }
  if (const json& last = status["last_result"]; last.is_object()) {
    const auto error = last["error"].get<std::string>();
    std::cout << fmt::format("last result: {} at {}: ", last["session"].get<std::string>(),
                             last["made_at"].get<std::string>())
              << (error.empty()
                      ? fmt::format("length {:.1f} mm, deflection {:.2f} mm", last["result"]["length_mm"].get<double>(),
                                    last["result"]["max_deflection_mm"].get<double>())
                      : "no measurement: " + error)
              << '\n';
  }
  for (const json& alarm : status["alarms"]) std::cout << "ALARM " << alarm["text"].get<std::string>() << '\n';
}

int run_status(const LineOptions& options, double timeout_s, bool as_json) {
  const auto link = LineLink::open(options);
  if (!link) return fail(link.error());
  const auto status = link->ask("status", "", to_milliseconds(timeout_s));
  if (!status) return fail(status.error());
  if (as_json) return print_json(*status);
  print_status(*status);
  return 0;
}

// ---- watch

struct WatchOptions {
  LineOptions line;
  std::size_t count = 0;   // 0: without end
  double timeout_s = 0.0;  // 0: without end
  bool results_only = false;
};

struct Event {
  json document;
  std::string text;
};

Event trigger_event(const Trigger& trigger) {
  return {{{"event", "trigger"},
           {"session", trigger.session},
           {"observation", trigger.observation},
           {"rotation_deg", trigger.rotation_deg},
           {"observations_expected", trigger.observations_expected}},
          fmt::format("trigger  session {} observation {}, rotation {} deg", trigger.session, trigger.observation,
                      trigger.rotation_deg)};
}

Event imprint_event(const Imprint& imprint) {
  return {
      {{"event", "imprint"},
       {"camera", imprint.camera_id},
       {"session", imprint.session},
       {"observation", imprint.observation},
       {"targets_used", imprint.quality.targets_used},
       {"reprojection_rms_px", imprint.quality.reprojection_rms_px},
       {"edge_coverage", imprint.quality.edge_coverage},
       {"pose_state", pose_state_name(imprint.pose_state)},
       {"pose_doubtful", imprint.pose_doubtful},
       {"failure", imprint.failure}},
      fmt::format("imprint  session {} observation {} {}: ", imprint.session, imprint.observation, imprint.camera_id) +
          (imprint.failure.empty()
               ? fmt::format("{} targets, reprojection rms {:.3f} px, coverage {:.0f} %", imprint.quality.targets_used,
                             imprint.quality.reprojection_rms_px, 100.0 * imprint.quality.edge_coverage)
               : "failed: " + imprint.failure)};
}

Event result_event(const ResultMessage& message) {
  json result = message.json.empty() ? json() : json::parse(message.json, nullptr, false);
  if (result.is_discarded()) result = nullptr;
  std::string text = fmt::format("result   session {}{}: ", message.session, message.complete ? "" : " (not complete)");
  const auto measurement =
      result.is_object() ? measurement_from_json(result) : Result<Measurement>(job_failed("{}", message.error));
  text += measurement
              ? fmt::format("length {:.1f} mm, deflection {:.2f} mm at {:.0f} mm, {} observation(s), {} warning(s)",
                            measurement->length_mm, measurement->max_deflection_mm, measurement->max_deflection_at_mm,
                            measurement->observations.size(), measurement->warnings.size())
              : "no measurement: " + measurement.error().message;
  return {{{"event", "result"},
           {"session", message.session},
           {"complete", message.complete},
           {"error", message.error},
           {"result", std::move(result)}},
          std::move(text)};
}

// Decodes on the transport's thread, which is quick, and hands the event to the printing one.
template <class Decode, class MakeEvent>
SampleCallback events_of(std::shared_ptr<BoundedQueue<Event>> queue, Decode decode, MakeEvent make_event) {
  return [queue, decode, make_event](const Sample& sample) {
    if (const auto message = decode(sample.payload)) queue->push(make_event(*message));
  };
}

// The events as one JSON array, a line each, closed when the watching ends.
class EventPrinter {
 public:
  explicit EventPrinter(bool as_json) : json_(as_json) {
    if (json_) std::cout << "[" << std::flush;
  }
  EventPrinter(const EventPrinter&) = delete;
  EventPrinter& operator=(const EventPrinter&) = delete;
  ~EventPrinter() {
    if (json_) std::cout << "\n]" << std::endl;
  }
  void print(const Event& event) {
    if (json_) {
      std::cout << (count_ > 0 ? ",\n" : "\n") << event.document.dump() << std::flush;
    } else {
      std::cout << event.text << std::endl;
    }
    ++count_;
  }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  bool json_;
  std::size_t count_ = 0;
};

int run_watch(const WatchOptions& options, bool as_json) {
  StopSignal stop;
  const auto link = LineLink::open(options.line);
  if (!link) return fail(link.error());
  Transport& transport = link->transport();
  const Keys& keys = link->keys();
  auto queue = std::make_shared<BoundedQueue<Event>>(kMaxQueuedEvents);
  std::vector<Result<std::unique_ptr<Declaration>>> declared;
  declared.push_back(transport.subscribe(keys.result(), {}, events_of(queue, decode_result, result_event)));
  if (!options.results_only) {
    declared.push_back(transport.subscribe(keys.trigger(), {}, events_of(queue, decode_trigger, trigger_event)));
    declared.push_back(transport.subscribe(keys.imprint(), {}, events_of(queue, decode_imprint, imprint_event)));
    declared.push_back(transport.watch_liveness(keys.alive(), [queue, keys](std::string_view key, bool alive) {
      const std::string camera = keys.camera_of(key).value_or(std::string(key));
      queue->push({{{"event", "camera"}, {"camera", camera}, {"alive", alive}},
                   fmt::format("camera   {} {}", camera, alive ? "connected" : "connection lost")});
    }));
  }
  for (const auto& declaration : declared) {
    if (!declaration) return fail(declaration.error());
  }
  EventPrinter printer(as_json);
  const auto until =
      options.timeout_s > 0.0 ? std::optional(steady_clock::now() + to_milliseconds(options.timeout_s)) : std::nullopt;
  while (!stop.wait_for(milliseconds(0))) {
    if (options.count > 0 && printer.count() >= options.count) return 0;
    if (until && steady_clock::now() >= *until) return options.count > 0 ? 1 : 0;
    if (const auto event = queue->pop_until(steady_clock::now() + kPoll)) printer.print(*event);
  }
  return 0;
}

// ---- trigger

struct TriggerOptions {
  LineOptions line;
  Trigger trigger;
  double fire_in_s = 0.0;
  std::optional<double> wait_s;
};

// The state of one observation in fusion's status document; null when fusion does not show it.
json observation_state(const json& status, const Trigger& trigger) {
  const json& session = status["session"];
  if (!session.is_object() || session["session"] != trigger.session) return nullptr;
  for (const json& observation : session["observations"]) {
    if (observation["index"] == trigger.observation) return observation;
  }
  return nullptr;
}

bool holds_observation(const json& session_result, std::uint32_t index) {
  const json& result = session_result["result"];
  return result.is_object() &&
         std::ranges::any_of(result["observations"], [&](const json& o) { return o["index"] == index; });
}

// Sends until fusion shows that it has the observation; a repeated trigger changes nothing.
Result<void> send(const LineLink& link, Publisher& publisher, const Trigger& trigger) {
  const auto message = encode_trigger(trigger);
  for (const auto until = steady_clock::now() + kStatusTimeout; steady_clock::now() < until;) {
    if (auto sent = publisher.put(message); !sent) return sent;
    for (const auto again = steady_clock::now() + std::chrono::seconds(1); steady_clock::now() < again;) {
      const auto status = link.ask("status", "", kAskTimeout);
      if (!status) return pass_on(status.error());
      // Its imprints may be there before the trigger itself, which may have been lost on the way to fusion.
      const json state = observation_state(*status, trigger);
      if (state.is_object() && state.value("triggered", true)) return {};
      std::this_thread::sleep_for(milliseconds(20));
    }
  }
  return job_failed("session {} observation {}: fusion did not take the trigger; its log says why", trigger.session,
                    trigger.observation);
}

// Fusion's result once it holds the observation; the error names the cameras that have not reported.
Result<json> await_result(const LineLink& link, const Trigger& trigger, steady_clock::time_point until,
                          const std::function<void(milliseconds)>& sleep) {
  json waiting, alarms;
  while (steady_clock::now() < until) {
    const auto status = link.ask("status", "", kAskTimeout);
    if (!status) return pass_on(status.error());
    alarms = (*status)["alarms"];
    const json state = observation_state(*status, trigger);
    const bool settled = state.is_object() && state["settled"].get<bool>();
    if (state.is_object()) waiting = state["waiting"];
    if (settled || state.is_null()) {  // null: another session has begun, so ask for the result itself
      const auto result = link.ask("result", "session=" + trigger.session, kAskTimeout);
      if (result && (settled || holds_observation(*result, trigger.observation))) return *result;
      if (!result && settled) return pass_on(result.error());
    }
    sleep(kPoll);
  }
  std::string why =
      waiting.empty() ? "all cameras have reported, fusion is not ready with it" : "no imprint of " + joined(waiting);
  for (const json& alarm : alarms) why += "; ALARM " + alarm["text"].get<std::string>();
  return job_failed("session {} observation {}: no result in time; {}", trigger.session, trigger.observation, why);
}

int print_result(const json& session_result, bool as_json) {
  if (!session_result["result"].is_object()) {
    return fail(Error{ErrorKind::job_failed,
                      fmt::format("session {}: no measurement: {}", session_result["session"].get<std::string>(),
                                  session_result["error"].get<std::string>())});
  }
  if (as_json) return print_json(session_result["result"]);
  const auto measurement = measurement_from_json(session_result["result"]);
  if (!measurement) return fail(measurement.error());
  std::cout << result_table(*measurement) << warning_lines(*measurement);
  return 0;
}

int run_trigger(const TriggerOptions& options, bool as_json) {
  Trigger trigger = options.trigger;
  if (options.fire_in_s > 0.0) trigger.fire_at_ns = wall_clock_ns() + std::llround(1e9 * options.fire_in_s);
  if (const auto valid = check_id("session", trigger.session); !valid) return fail(valid.error());
  const auto link = LineLink::open(options.line);
  if (!link) return fail(link.error());
  // Without fusion nobody would keep the trigger or its imprints: better not to fire.
  if (const auto status = link->ask("status", "", kStatusTimeout); !status) return fail(status.error());

  std::mutex mutex;
  std::condition_variable changed;
  bool result_came = false;
  const auto subscription = link->transport().subscribe(link->keys().result(trigger.session), {}, [&](const Sample&) {
    const std::lock_guard lock(mutex);
    result_came = true;
    changed.notify_all();
  });
  if (!subscription) return fail(subscription.error());
  const auto publisher = link->transport().publish(link->keys().trigger(), {.traffic = Traffic::command, .history = 0});
  if (!publisher) return fail(publisher.error());
  const auto begin = steady_clock::now();
  if (const auto sent = send(*link, **publisher, trigger); !sent) return fail(sent.error());
  if (!options.wait_s) {
    if (as_json) {
      return print_json({{"session", trigger.session},
                         {"observation", trigger.observation},
                         {"rotation_deg", trigger.rotation_deg},
                         {"observations_expected", trigger.observations_expected}});
    }
    std::cout << fmt::format("session {} observation {}: triggered\n", trigger.session, trigger.observation);
    return 0;
  }
  // The announcement only ends the pause early: fusion's answer is what counts.
  const auto result = await_result(*link, trigger, begin + to_milliseconds(*options.wait_s), [&](milliseconds pause) {
    std::unique_lock lock(mutex);
    changed.wait_for(lock, pause, [&] { return result_came; });
    result_came = false;
  });
  if (!result) return fail(result.error());
  return print_result(*result, as_json);
}

}  // namespace

void add_live_commands(Cli& cli) {
  struct StatusOptions {
    LineOptions line;
    double timeout_s = 3.0;
  };
  auto status_options = std::make_shared<StatusOptions>();
  CLI::App* status = cli.command(
      cli.app, "status", "the running line: cameras, health, fusion, last session",
      [&cli, status_options] { return run_status(status_options->line, status_options->timeout_s, cli.json); });
  add_line_options(*status, status_options->line);
  status->add_option("--timeout", status_options->timeout_s, "s to wait for fusion")
      ->check(between(0.1, 3600))
      ->capture_default_str();

  auto watch_options = std::make_shared<WatchOptions>();
  CLI::App* watch = cli.command(cli.app, "watch", "prints triggers, imprints and results as they come, until Ctrl-C",
                                [&cli, watch_options] { return run_watch(*watch_options, cli.json); });
  add_line_options(*watch, watch_options->line);
  watch->add_option("--count", watch_options->count, "end after this many events")->check(between(1, 1e9));
  watch
      ->add_option("--timeout", watch_options->timeout_s,
                   "end after this many s; exit status 1 when --count was not reached")
      ->check(between(0.1, 1e9));
  watch->add_flag("--results", watch_options->results_only, "only results");

  auto trigger_options = std::make_shared<TriggerOptions>();
  CLI::App* trigger = cli.command(cli.app, "trigger", "makes all cameras of the line take one observation of a forging",
                                  [&cli, trigger_options] { return run_trigger(*trigger_options, cli.json); });
  add_line_options(*trigger, trigger_options->line);
  trigger->add_option("--session", trigger_options->trigger.session, "name of this forging's measurement")->required();
  trigger->add_option("--observation", trigger_options->trigger.observation, "index, from 0")->check(between(0, 1e6));
  trigger->add_option("--rotation-deg", trigger_options->trigger.rotation_deg, "of the forging about its axis")
      ->check(between(-3600, 3600));
  trigger->add_option("--expect", trigger_options->trigger.observations_expected, "observations this session will have")
      ->check(between(1, 1e6));
  trigger->add_option("--in", trigger_options->fire_in_s, "s from now at which all cameras fire; else at once")
      ->check(between(0, 60));
  trigger
      ->add_option("--wait", trigger_options->wait_s, "s to wait for the result; exit status 1 when it does not come")
      ->check(between(0.1, 86'400));
}

}  // namespace imprint
