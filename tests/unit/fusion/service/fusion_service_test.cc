#include "fusion/fusion_service.h"

#include <mutex>
#include <thread>

#include <catch2/catch.hpp>

#include "lib/clock/wall_clock.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using namespace std::chrono_literals;

// A measurement that only tells what went into it.
Result<Measurement> count_imprints(const std::vector<Observation>& observations, const ForgingSpec& /*forging*/,
                                   std::string session, std::string method) {
  Measurement measurement;
  measurement.session = std::move(session);
  measurement.method = std::move(method);
  for (const Observation& observation : observations) {
    measurement.observations.push_back({observation.index, observation.rotation_deg, {}});
    measurement.length_mm += static_cast<double>(observation.imprints.size());
    for (const auto& [camera, why] : observation.missing) measurement.warnings.push_back(camera + ": " + why);
  }
  if (measurement.length_mm == 0.0) return job_failed("no imprint at all");
  return measurement;
}

bool eventually(const std::function<bool()>& condition) {
  for (int i = 0; i < 500; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

// Three cameras on one bus with a fusion that can be started and stopped, its store on disk.
struct Plant {
  TemporaryFolder folder;
  std::shared_ptr<MemoryBus> bus = make_memory_bus();
  std::unique_ptr<Transport> outside = open_memory(bus);
  Keys keys = *Keys::of("plant", "L1");
  std::unique_ptr<Publisher> triggers = *outside->publish(keys.trigger(), {.traffic = Traffic::command, .history = 16});
  std::map<std::string, std::unique_ptr<Publisher>> imprints;
  std::mutex mutex;
  std::vector<ResultMessage> results;
  std::vector<Trigger> seen_triggers;
  std::vector<std::unique_ptr<Declaration>> declarations;
  FusionConfig config;
  std::atomic<bool> hang = false;  // the fusion does not come back as long as this is set

  std::unique_ptr<SessionStore> store;
  std::unique_ptr<LineBoard> board;
  std::unique_ptr<Transport> inside;
  std::unique_ptr<FusionService> fusion;

  explicit Plant(double deadline_s = 30.0) {
    config.assembler.deadline_s = deadline_s;
    config.result_dir = folder / "results";
    for (const char* camera : {"cam1", "cam2", "cam3"}) {
      imprints[camera] = *outside->publish(keys.imprint(camera), {.traffic = Traffic::imprint, .history = 256});
    }
    declarations.push_back(*outside->subscribe(keys.result(), {}, [this](const Sample& sample) {
      const std::lock_guard lock(mutex);
      if (const auto result = decode_result(sample.payload)) results.push_back(*result);
    }));
    declarations.push_back(*outside->subscribe(keys.trigger(), {}, [this](const Sample& sample) {
      const std::lock_guard lock(mutex);
      if (const auto trigger = decode_trigger(sample.payload)) seen_triggers.push_back(*trigger);
    }));
    start();
  }

  void start() {
    Rig rig;
    for (const char* camera : {"cam1", "cam2", "cam3"}) {
      rig.cameras.emplace_back();
      rig.cameras.back().id = camera;
    }
    store = *SessionStore::open(folder / "imprint.db");
    board =
        std::make_unique<LineBoard>(LineBoard::Identity{"plant", "L1", "best", "0"},
                                    std::vector<std::string>{"cam1", "cam2", "cam3"}, std::chrono::steady_clock::now());
    inside = open_memory(bus);
    fusion = std::make_unique<FusionService>(config, rig, *inside, *store, *board,
                                             [this](const auto& observations, const auto&... rest) {
                                               while (hang) std::this_thread::sleep_for(1ms);
                                               return count_imprints(observations, rest...);
                                             });
    REQUIRE(fusion->start());
  }

  void stop() {
    fusion.reset();
    inside.reset();
    store.reset();
  }

  void trigger(std::uint32_t observation, std::uint32_t expected, const std::string& session = "S") {
    REQUIRE(triggers->put(encode_trigger({session, observation, 90.0 * observation, 0, expected})));
  }

  void answer(const std::string& camera, std::uint32_t observation, std::uint64_t sequence,
              const std::string& session = "S") {
    Imprint imprint;
    imprint.camera_id = camera;
    imprint.session = session;
    imprint.observation = observation;
    imprint.rotation_deg = 90.0 * observation;
    imprint.boot_id = 5;
    imprint.sequence = sequence;
    imprint.failure = "no forging found";
    REQUIRE(imprints.at(camera)->put(encode_imprint(imprint)));
  }

  std::size_t result_count() {
    const std::lock_guard lock(mutex);
    return results.size();
  }
  ResultMessage last_result() {
    const std::lock_guard lock(mutex);
    return results.back();
  }
  nlohmann::json status() {
    const auto replies = outside->get(keys.fusion_service("status"), {}, 2s);
    REQUIRE(replies);
    REQUIRE(replies->size() == 1);
    return nlohmann::json::parse(replies->front().payload);
  }
  double counted(const std::string& counter) { return status()["counters"][counter]; }
};

double length_of(const ResultMessage& result) { return nlohmann::json::parse(result.json)["length_mm"]; }

}  // namespace

TEST_CASE("fusion: a session's result is stored before it is announced, once an observation, complete with the last") {
  Plant plant;
  plant.trigger(0, 2);
  for (const char* camera : {"cam1", "cam2", "cam3"}) plant.answer(camera, 0, 1);
  REQUIRE(eventually([&] { return plant.result_count() == 1; }));
  REQUIRE_FALSE(plant.last_result().complete);
  REQUIRE(plant.store->result("S")->value().json == plant.last_result().json);
  plant.trigger(1, 2);
  for (const char* camera : {"cam1", "cam2", "cam3"}) plant.answer(camera, 1, 2);
  REQUIRE(eventually([&] { return plant.result_count() == 2; }));
  REQUIRE(plant.last_result().complete);
  REQUIRE(length_of(plant.last_result()) == 6.0);
  REQUIRE(plant.store->result("S")->value().complete);
  REQUIRE(std::filesystem::exists(plant.folder / "results/S/result.json"));
}

TEST_CASE("fusion: a camera that never reports is named after the deadline") {
  Plant plant(0.3);
  plant.trigger(0, 1);
  plant.answer("cam1", 0, 1);
  plant.answer("cam2", 0, 1);
  REQUIRE(eventually([&] { return plant.result_count() == 1; }));
  REQUIRE(plant.last_result().complete);
  REQUIRE(plant.last_result().json.find("cam3: not connected, no imprint within 0.3 s") != std::string::npos);
  plant.answer("cam3", 0, 1);  // late
  REQUIRE(eventually([&] { return plant.result_count() == 2; }));
  REQUIRE(length_of(plant.last_result()) == 3.0);
}

TEST_CASE("fusion: an observation without any imprint gives a result that says why there is none") {
  Plant plant(0.2);
  plant.trigger(0, 1);
  REQUIRE(eventually([&] { return plant.result_count() == 1; }));
  REQUIRE(plant.last_result().error == "no imprint at all");
  REQUIRE(plant.last_result().json.empty());
}

TEST_CASE("fusion: stopped after the first observation and started again, the result has both") {
  Plant plant;
  plant.trigger(0, 2);
  for (const char* camera : {"cam1", "cam2", "cam3"}) plant.answer(camera, 0, 1);
  REQUIRE(eventually([&] { return plant.result_count() == 1; }));
  plant.stop();
  plant.start();
  plant.trigger(1, 2);
  for (const char* camera : {"cam1", "cam2", "cam3"}) plant.answer(camera, 1, 2);
  REQUIRE(eventually([&] { return plant.result_count() >= 1 && plant.last_result().complete; }));
  REQUIRE(length_of(plant.last_result()) == 6.0);
}

TEST_CASE("fusion: imprints sent while it was away are taken from the nodes' history") {
  Plant plant;
  plant.stop();
  plant.trigger(0, 1);
  for (const char* camera : {"cam1", "cam2", "cam3"}) plant.answer(camera, 0, 1);
  plant.start();
  REQUIRE(eventually([&] { return plant.result_count() >= 1 && plant.last_result().complete; }));
  REQUIRE(length_of(plant.last_result()) == 3.0);
}

TEST_CASE("fusion: a late imprint of a finished session after a restart adds to it and replaces nothing") {
  Plant plant(0.3);
  plant.trigger(0, 1);
  plant.answer("cam1", 0, 1);
  plant.answer("cam2", 0, 1);
  REQUIRE(eventually([&] { return plant.result_count() == 1; }));
  plant.stop();
  plant.start();
  plant.answer("cam3", 0, 1);
  // The trigger comes again from its history; when it is ahead of the imprint the session is evaluated in between.
  REQUIRE(eventually([&] { return plant.result_count() >= 2 && length_of(plant.last_result()) == 3.0; }));
  REQUIRE(plant.last_result().complete);
}

TEST_CASE("fusion: a camera that connects while it is waited for is sent the trigger again, no other is") {
  Plant plant;
  plant.trigger(0, 1);
  plant.answer("cam1", 0, 1);
  REQUIRE(eventually([&] { return plant.counted("imprints") == 1; }));
  const auto answered = plant.outside->announce(plant.keys.alive("cam1"));
  REQUIRE(eventually([&] { return plant.status()["cameras"][0]["alive"] == true; }));
  std::this_thread::sleep_for(50ms);
  {
    const std::lock_guard lock(plant.mutex);
    REQUIRE(plant.seen_triggers.size() == 1);
  }
  const auto waited_for = plant.outside->announce(plant.keys.alive("cam2"));
  REQUIRE(eventually([&] {
    const std::lock_guard lock(plant.mutex);
    return plant.seen_triggers.size() == 2;
  }));
  const std::lock_guard lock(plant.mutex);
  REQUIRE(plant.seen_triggers[1].session == "S");
  REQUIRE(plant.seen_triggers[1].observation == 0);
}

TEST_CASE("fusion: what is malformed, too large, of a foreign camera or under a foreign key is dropped and counted") {
  Plant plant;
  plant.answer("cam1", 0, 1);
  plant.answer("cam1", 0, 1);  // once more
  REQUIRE(plant.imprints["cam1"]->put(Bytes{1, 2, 3}));
  REQUIRE(plant.imprints["cam1"]->put(Bytes(1'000'000, 7)));
  REQUIRE(plant.triggers->put(Bytes{0xFF}));
  auto foreign = plant.outside->publish(plant.keys.imprint("cam9"), {});
  REQUIRE(foreign);
  Imprint imprint;
  imprint.camera_id = "cam9";
  imprint.session = "S";
  imprint.sequence = 1;
  imprint.failure = "x";
  REQUIRE((*foreign)->put(encode_imprint(imprint)));
  imprint.camera_id = "cam2";  // pretends to be another
  REQUIRE((*foreign)->put(encode_imprint(imprint)));
  REQUIRE(eventually([&] { return plant.counted("malformed") == 4; }));
  REQUIRE(plant.counted("refused") == 1);
  REQUIRE(plant.counted("imprints") == 1);
  REQUIRE(plant.counted("repeated") == 1);
  REQUIRE(plant.store->messages("S")->size() == 1);
}

TEST_CASE("fusion: a node hears of every imprint that is on disk, again when it sends it again, and of one refused") {
  Plant plant;
  std::mutex mutex;
  std::vector<Receipt> receipts;
  const auto heard = plant.outside->subscribe(plant.keys.receipt("cam1"), {}, [&](const Sample& sample) {
    const std::lock_guard lock(mutex);
    receipts.push_back(*decode_receipt(sample.payload));
  });
  plant.answer("cam1", 0, 1);
  plant.answer("cam1", 0, 1);
  plant.answer("cam1", 9999, 2);  // beyond what a session can have
  REQUIRE(eventually([&] {
    const std::lock_guard lock(mutex);
    return receipts.size() == 3;
  }));
  const std::lock_guard lock(mutex);
  for (int i : {0, 1}) {
    REQUIRE(receipts[i].boot_id == 5);
    REQUIRE(receipts[i].sequence == 1);
    REQUIRE(receipts[i].refused.empty());
  }
  REQUIRE(receipts[2].sequence == 2);
  REQUIRE(receipts[2].refused == "a session has at most 64 observations");
  REQUIRE(plant.store->messages("S")->size() == 1);
}

TEST_CASE("fusion: a gap is named until it is filled, also after a restart, and so is what a node says it holds") {
  Plant plant;
  const auto delivery = [&] { return plant.status()["cameras"][0]["delivery"]; };
  plant.answer("cam1", 0, 1);
  plant.answer("cam1", 3, 4);
  REQUIRE(eventually([&] { return delivery()["missing_numbers"] == "2-3"; }));
  plant.stop();
  plant.start();
  REQUIRE(delivery()["missing_numbers"] == "2-3");
  plant.answer("cam1", 1, 2);
  plant.answer("cam1", 2, 3);
  REQUIRE(eventually([&] { return delivery()["missing"] == 0; }));
  REQUIRE(plant.counted("reordered") == 2);

  const auto reports = plant.outside->publish(plant.keys.delivery("cam1"), {.traffic = Traffic::health});
  Delivery report;
  report.camera_id = "cam1";
  report.boot_id = 5;
  report.sequence = 6;
  report.oldest_waiting = 5;
  report.waiting = 2;
  report.discarded = 3;
  REQUIRE((*reports)->put(encode_delivery(report)));
  REQUIRE(eventually([&] { return delivery()["node"].is_object(); }));
  REQUIRE(delivery()["node"]["waiting"] == 2);
  REQUIRE(delivery()["missing_numbers"] == "5-6");
  REQUIRE(plant.status()["alarms"][0]["name"] == "discarded_cam1");
}

TEST_CASE("fusion: more sessions than are held at a time, camera by camera: each has its result, whole and once") {
  Plant plant;
  constexpr std::uint64_t kSessions = 40;  // 16 are held
  for (std::uint64_t i = 0; i < kSessions; ++i) plant.trigger(0, 1, fmt::format("S{}", i));
  for (const char* camera : {"cam1", "cam2", "cam3"}) {
    for (std::uint64_t i = 0; i < kSessions; ++i) plant.answer(camera, 0, i + 1, fmt::format("S{}", i));
  }
  REQUIRE(eventually([&] { return plant.result_count() >= kSessions; }));
  std::this_thread::sleep_for(100ms);
  REQUIRE(plant.result_count() == kSessions);
  for (std::uint64_t i = 0; i < kSessions; ++i) {
    const auto result = plant.store->result(fmt::format("S{}", i));
    REQUIRE(result->value().complete);
    REQUIRE(nlohmann::json::parse(result->value().json)["length_mm"] == 3.0);
  }
}

TEST_CASE("fusion: sessions that had to leave unfinished are evaluated when their time is up") {
  Plant plant(0.5);
  constexpr std::uint64_t kSessions = 40;
  for (std::uint64_t i = 0; i < kSessions; ++i) plant.answer("cam1", 0, i + 1, fmt::format("S{}", i));
  REQUIRE(eventually([&] { return plant.store->unevaluated()->empty() && plant.counted("imprints") == kSessions; }));
  REQUIRE(plant.store->sessions(100)->size() == kSessions);
}

TEST_CASE("fusion: taken up again, a result that comes out the same is neither stored nor announced once more") {
  Plant plant;
  plant.trigger(0, 2);
  for (const char* camera : {"cam1", "cam2", "cam3"}) plant.answer(camera, 0, 1);
  REQUIRE(eventually([&] { return plant.result_count() == 1; }));
  const std::string before = plant.store->result("S")->value().json;
  plant.stop();
  std::filesystem::remove_all(plant.folder / "results");
  plant.start();
  REQUIRE(eventually([&] { return plant.status()["session"].is_object(); }));
  plant.trigger(1, 2);  // comes after what was taken up
  REQUIRE(eventually([&] { return plant.counted("dropped") == 0 && plant.store->messages("S")->size() == 5; }));
  REQUIRE(plant.store->result("S")->value().revision == 1);
  REQUIRE(plant.store->result("S")->value().json == before);
  REQUIRE(plant.result_count() == 1);
  REQUIRE(std::filesystem::exists(plant.folder / "results/S/result.json"));  // as if killed before it was written
}

TEST_CASE("fusion: a node's clock is measured when it comes, alarmed about when it is off, and told to the node") {
  Plant plant;
  constexpr std::int64_t kHourNs = 3'600'000'000'000;
  std::mutex mutex;
  std::optional<std::int64_t> told_ns;
  const auto clock = plant.outside->answer(plant.keys.service("cam2", "clock"), [&](std::shared_ptr<Query> query) {
    const auto question = decode_clock_question(query->payload());
    {
      const std::lock_guard lock(mutex);
      if (question->offset_ns) told_ns = *question->offset_ns;
    }
    (void)query->reply(encode_clock_reading({wall_clock_ns() - kHourNs, wall_clock_ns() - kHourNs}));
  });
  const auto measured = [&] { return plant.status()["cameras"][1]["clock"]; };
  auto token = plant.outside->announce(plant.keys.alive("cam2"));
  REQUIRE(eventually([&] { return measured().is_object(); }));
  REQUIRE(measured()["offset_s"].get<double>() == Approx(-3600.0).margin(0.5));  // a busy machine
  REQUIRE(measured()["uncertainty_s"].get<double>() < 0.5);
  REQUIRE(plant.status()["alarms"][0]["name"] == "clock_cam2");
  REQUIRE(plant.status()["cameras"][0]["clock"].is_null());
  (*token).reset();
  token = plant.outside->announce(plant.keys.alive("cam2"));  // asked again at once
  REQUIRE(eventually([&] {
    const std::lock_guard lock(mutex);
    return told_ns.has_value();
  }));
  REQUIRE(1e-9 * static_cast<double>(*told_ns) == Approx(-3600.0).margin(0.5));
}

TEST_CASE("fusion: its turns are counted while it is idle and while it works, not while a fusion hangs") {
  Plant plant(0.2);
  const auto turned_since = [&](std::uint64_t turns) {
    return eventually([&] { return plant.fusion->turns() > turns; });
  };
  REQUIRE(turned_since(0));
  REQUIRE(turned_since(plant.fusion->turns()));  // idle
  plant.hang = true;
  plant.trigger(0, 1);
  plant.answer("cam1", 0, 1);
  std::this_thread::sleep_for(1s);  // the deadline has long passed, the fusion has begun
  const std::uint64_t turns = plant.fusion->turns();
  std::this_thread::sleep_for(2500ms);  // idle it would turn twice
  REQUIRE(plant.fusion->turns() == turns);
  plant.hang = false;
  REQUIRE(turned_since(turns));
  REQUIRE(eventually([&] { return plant.result_count() == 1; }));
}

TEST_CASE("fusion: it answers what a session's result is, and that there is none") {
  Plant plant(0.2);
  REQUIRE_FALSE(plant.outside->get(plant.keys.fusion_service("result") + "?session=S", {}, 2s));
  plant.trigger(0, 1);
  plant.answer("cam1", 0, 1);
  REQUIRE(eventually([&] { return plant.result_count() == 1; }));
  const auto replies = plant.outside->get(plant.keys.fusion_service("result") + "?session=S", {}, 2s);
  REQUIRE(replies);
  const auto document = nlohmann::json::parse(replies->at(0).payload);
  REQUIRE(document["session"] == "S");
  REQUIRE(document["result"]["length_mm"] == 1.0);
}

TEST_CASE("fusion: a camera's word that the forging rests fires all cameras at one moment, two cameras' once") {
  Plant plant;
  const auto say = [&](const std::string& camera) {
    auto publisher = *plant.outside->publish(plant.keys.rest(camera), {.traffic = Traffic::command});
    REQUIRE(publisher->put(encode_rest({camera, wall_clock_ns()})));
  };
  const auto fired = [&] {
    const std::lock_guard lock(plant.mutex);
    return plant.seen_triggers;
  };
  say("cam1");
  std::this_thread::sleep_for(200ms);
  REQUIRE(fired().empty());  // off by default
  plant.stop();
  plant.config.rest.accept = true;
  plant.config.rest.plan.observations = 2;
  plant.config.rest.quiet_s = 0.5;
  plant.start();
  const std::int64_t before_ns = wall_clock_ns();
  say("cam9");  // of no rig
  say("cam1");
  say("cam2");
  REQUIRE(eventually([&] { return fired().size() == 1; }));
  std::this_thread::sleep_for(600ms);
  say("cam2");
  REQUIRE(eventually([&] { return fired().size() == 2; }));
  const auto triggers = fired();
  REQUIRE(triggers[0].session.starts_with("rest-"));
  REQUIRE(triggers[0].fire_at_ns >= before_ns + 300'000'000);
  REQUIRE(triggers[0].observations_expected == 2);
  REQUIRE(triggers[1].session == triggers[0].session);
  REQUIRE(triggers[1].observation == 1);
  REQUIRE(triggers[1].rotation_deg == 60.0);
}

}  // namespace imprint
