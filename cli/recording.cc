#include <atomic>
#include <cmath>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <thread>

#include "cli/command.h"
#include "cli/command_line.h"
#include "cli/line_link.h"
#include "fusion/fusion_pipeline.h"
#include "fusion/receive/observation_assembler.h"
#include "fusion/results/measurement.h"
#include "lib/clock/wall_clock.h"
#include "lib/daemon/bounded_queue.h"
#include "lib/daemon/stop_signal.h"
#include "lib/recording/mcap_file.h"
#include "lib/rig/rig.h"
#include "lib/wire/schema.h"
#include "lib/wire/wire.h"

namespace imprint {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::size_t kMaxQueued = 4096;
constexpr std::size_t kHistory = 16;
constexpr auto kPoll = milliseconds(200);
constexpr auto kPace = milliseconds(2);  // between messages fed to fusion: below what it stores in a second
constexpr std::uint32_t kMaxObservations = 4096;

// ---- record

struct RecordOptions {
  LineOptions line;
  std::string out;
  double seconds = 0.0;
};

struct Heard {
  Sample sample;
  std::string message;  // of imprint.v1
  std::int64_t time_ns = 0;
};

int run_record(const RecordOptions& options, bool as_json) {
  StopSignal stop;
  const auto link = LineLink::open(options.line);
  if (!link) return fail(link.error());
  auto writer = McapWriter::open(options.out);
  if (!writer) return fail(writer.error());
  const auto queue = std::make_shared<BoundedQueue<Heard>>(kMaxQueued);
  const auto dropped = std::make_shared<std::atomic<std::uint64_t>>(0);
  std::vector<Result<std::unique_ptr<Declaration>>> declared;
  const Keys& keys = link->keys();
  for (const auto& [key, message, history] :
       {std::tuple(keys.trigger(), "Trigger", std::size_t{0}), std::tuple(keys.imprint(), "Imprint", kHistory),
        std::tuple(keys.health(), "Health", std::size_t{0}), std::tuple(keys.delivery(), "Delivery", std::size_t{0}),
        std::tuple(keys.result(), "Result", std::size_t{0})}) {
    declared.push_back(link->transport().subscribe(key, {.history = history}, [=](const Sample& sample) {
      if (!queue->push({sample, message, wall_clock_ns()})) ++*dropped;
    }));
    if (!declared.back()) return fail(declared.back().error());
  }
  std::map<std::string, std::uint64_t> counts;
  const auto until = options.seconds > 0.0
                         ? std::optional(steady_clock::now() + milliseconds(std::llround(1000.0 * options.seconds)))
                         : std::nullopt;
  bool ended = false;
  while (!ended || !queue->finished()) {
    if (!ended && (stop.wait_for(milliseconds(0)) || (until && steady_clock::now() >= *until))) {
      ended = true;
      declared.clear();  // what has been heard is still written
      queue->close();
    }
    const auto heard = queue->pop_until(steady_clock::now() + kPoll);
    if (!heard) continue;
    if (auto written = writer->write(heard->sample.key, "imprint.v1." + heard->message, schema_of(heard->message),
                                     heard->time_ns, heard->sample.payload);
        !written)
      return fail(written.error());
    ++counts[heard->message];
  }
  if (auto closed = writer->close(); !closed) return fail(closed.error());
  if (*dropped > 0) std::cerr << fmt::format("imprint: {} messages came too fast and are missing\n", dropped->load());
  if (as_json) return print_json({{"file", options.out}, {"messages", counts}, {"dropped", dropped->load()}});
  std::cout << options.out;
  for (const auto& [message, count] : counts) std::cout << fmt::format(", {} {}", count, message);
  std::cout << '\n';
  return 0;
}

// ---- replay

struct ReplayOptions {
  std::string file;
  std::string rig;
  std::string session;
  std::optional<std::string> geometry;  // else as recorded
  std::optional<std::string> connect;
  LineOptions line;
};

struct Recording {
  std::vector<McapMessage> messages;             // triggers and imprints
  std::map<std::string, ResultMessage> results;  // the last of each session
};

// The triggers, imprints and results of the wanted session, or of all; what is none is told and left out.
Result<Recording> read_recording(const ReplayOptions& options) {
  auto content = read_mcap(options.file);
  if (!content) return pass_on(content.error());
  if (content->cut_off)
    std::cerr << fmt::format("imprint: {}: the recording was cut off; used up to there\n", options.file);
  Recording recording;
  const auto wanted = [&](const std::string& session) { return options.session.empty() || session == options.session; };
  const auto skipped = [](const McapMessage& message, const Error& error) {
    std::cerr << fmt::format("imprint: a message of {} is left out: {}\n", message.topic, error.message);
  };
  for (McapMessage& message : content->messages) {
    if (message.schema == "imprint.v1.Trigger") {
      const auto trigger = decode_trigger(message.bytes);
      if (!trigger) {
        skipped(message, trigger.error());
      } else if (wanted(trigger->session)) {
        recording.messages.push_back(std::move(message));
      }
    } else if (message.schema == "imprint.v1.Imprint") {
      const auto imprint = decode_imprint(message.bytes);
      if (!imprint) {
        skipped(message, imprint.error());
      } else if (wanted(imprint->session)) {
        recording.messages.push_back(std::move(message));
      }
    } else if (message.schema == "imprint.v1.Result") {
      if (auto result = decode_result(message.bytes); result && wanted(result->session))
        recording.results[result->session] = std::move(*result);
    }
  }
  if (recording.messages.empty()) {
    return job_failed("{}: no trigger and no imprint{}", options.file,
                      options.session.empty() ? "" : " of session " + options.session);
  }
  return recording;
}

// What is measured, without what only the live run knew: when, where, who came late, whose clock was off.
json measured_only(json result) {
  for (const char* key : {"made_at", "line", "warnings"}) result.erase(key);
  return result;
}

// Fuses every session of the recording anew, without a line.
int evaluate(const ReplayOptions& options, bool as_json) {
  const auto recording = read_recording(options);
  if (!recording) return fail(recording.error());
  const auto rig = read_rig(options.rig);
  if (!rig) return fail(rig.error());
  std::vector<std::string> cameras;
  for (const CameraModel& camera : rig->cameras) cameras.push_back(camera.id);
  std::set<std::string> sessions;
  for (const McapMessage& message : recording->messages) {
    const auto trigger = message.schema == "imprint.v1.Trigger" ? decode_trigger(message.bytes) : invalid_input("");
    const auto imprint = message.schema == "imprint.v1.Imprint" ? decode_imprint(message.bytes) : invalid_input("");
    sessions.insert(trigger ? trigger->session : imprint->session);
  }
  json results = json::array();
  bool all_well = true;
  for (const std::string& session : sessions) {
    AssemblerConfig config;
    config.max_observations = kMaxObservations;
    ObservationAssembler assembler(cameras, config);
    const ObservationAssembler::Time begin{};
    for (const McapMessage& message : recording->messages) {
      if (message.schema == "imprint.v1.Trigger") {
        const auto trigger = decode_trigger(message.bytes);
        if (trigger && trigger->session == session) (void)assembler.add(*trigger, begin);
      } else if (const auto imprint = decode_imprint(message.bytes); imprint && imprint->session == session) {
        assembler.add(*imprint, begin);
      }
    }
    assembler.settle(begin + std::chrono::hours(2));
    const auto recorded = recording->results.find(session);
    const json before =
        recorded == recording->results.end() ? json() : json::parse(recorded->second.json, nullptr, false);
    const std::string method = before.is_object() ? before.value("method", "best") : "best";
    const std::string geometry =
        options.geometry.value_or(before.is_object() ? before.value("geometry", "joint") : "joint");
    const auto measurement =
        fuse(assembler.observations(session), rig->forging, session, method, geometry_method_of(geometry));
    json entry = {{"session", session}, {"error", ""}, {"result", nullptr}, {"same_as_recorded", nullptr}};
    if (measurement) {
      entry["result"] = to_json(*measurement);
    } else {
      entry["error"] = measurement.error().message;
    }
    if (recorded != recording->results.end()) {
      const bool same = before.is_object() == measurement.has_value() &&
                        (!measurement || measured_only(before) == measured_only(entry["result"]));
      entry["same_as_recorded"] = same;
      all_well = all_well && same;
    }
    if (!as_json) {
      std::cout << fmt::format("session {}: {}{}\n", session,
                               measurement ? fmt::format("length {:.3f} mm, deflection {:.3f} mm",
                                                         measurement->length_mm, measurement->max_deflection_mm)
                                           : "no measurement: " + measurement.error().message,
                               entry["same_as_recorded"].is_null() ? ""
                               : entry["same_as_recorded"]         ? ", the same as recorded"
                                                                   : ", DIFFERS from the recorded result");
    }
    results.push_back(std::move(entry));
  }
  if (as_json) print_json({{"sessions", std::move(results)}});
  return all_well ? 0 : 1;
}

// Sends triggers and imprints to a running fusion, which stores and fuses them as if they came from cameras.
int feed(const ReplayOptions& options, bool as_json) {
  const auto recording = read_recording(options);
  if (!recording) return fail(recording.error());
  LineOptions line = options.line;
  line.connect = *options.connect;
  const auto link = LineLink::open(line);
  if (!link) return fail(link.error());
  if (const auto status = link->ask("status", "", milliseconds(5000)); !status) return fail(status.error());
  std::map<std::string, std::unique_ptr<Publisher>> publishers;
  for (const McapMessage& message : recording->messages) {
    const auto imprint = message.schema == "imprint.v1.Imprint" ? decode_imprint(message.bytes) : invalid_input("");
    const std::string key = imprint ? link->keys().imprint(imprint->camera_id) : link->keys().trigger();
    auto& publisher = publishers[key];
    if (!publisher) {
      auto opened = link->transport().publish(key, {.traffic = Traffic::command, .history = 0});
      if (!opened) return fail(opened.error());
      publisher = std::move(*opened);
    }
    if (auto sent = publisher->put(message.bytes); !sent) return fail(sent.error());
    std::this_thread::sleep_for(kPace);
  }
  // An answer says that all before it has been received.
  if (const auto status = link->ask("status", "", milliseconds(5000)); !status) return fail(status.error());
  if (as_json) return print_json({{"messages", recording->messages.size()}});
  std::cout << fmt::format("{} triggers and imprints sent\n", recording->messages.size());
  return 0;
}

}  // namespace

void add_recording_commands(Cli& cli) {
  auto record_options = std::make_shared<RecordOptions>();
  CLI::App* record = cli.command(cli.app, "record", "writes what passes over the line to an MCAP file, until Ctrl-C",
                                 [&cli, record_options] { return run_record(*record_options, cli.json); });
  add_line_options(*record, record_options->line);
  record->add_option("--out", record_options->out, "recording.mcap")->required();
  record->add_option("--seconds", record_options->seconds, "end after this many s")->check(between(0.1, 1e9));

  auto replay_options = std::make_shared<ReplayOptions>();
  CLI::App* replay =
      cli.command(cli.app, "replay", "fuses a recording anew, here or in a running fusion", [&cli, replay_options] {
        if (replay_options->connect.has_value() == !replay_options->rig.empty()) {
          return fail(Error{ErrorKind::invalid_input,
                            "replay: expected either --rig (fuse here) or --connect (feed a running fusion)"});
        }
        return replay_options->connect ? feed(*replay_options, cli.json) : evaluate(*replay_options, cli.json);
      });
  replay->add_option("FILE", replay_options->file, "recording.mcap")->required();
  replay->add_option("--rig", replay_options->rig, "rig.toml: fuse here, and compare with the recorded results");
  replay->add_option("--connect", replay_options->connect, "feed the fusion whose router listens there");
  replay->add_option("--site", replay_options->line.site, "of that fusion")->capture_default_str();
  replay->add_option("--line", replay_options->line.line, "of that fusion")->capture_default_str();
  replay->add_option("--geometry", replay_options->geometry, "with --rig: joint or thesis; else as recorded")
      ->check(CLI::IsMember(std::vector<std::string>(kGeometryMethods.begin(), kGeometryMethods.end())));
  replay->add_option("--session", replay_options->session, "only this one");
}

}  // namespace imprint
