#include <catch2/catch.hpp>

#include <atomic>
#include <future>

#include "tests/unit/lib/transport/plants.h"

using namespace imprint;
using namespace imprint::test;
using namespace std::chrono_literals;

// The same claims for Zenoh and for its twin in memory: a test of a program that runs on the twin
// says something about the program on Zenoh.
#define BOTH_TRANSPORTS ZenohPlant, MemoryPlant

namespace {

using Texts = std::vector<std::string>;

SampleCallback into(Gathered<std::string>& texts) {
  return [&texts](const Sample& sample) { texts.add(text(sample.payload)); };
}

std::string numbered(int i) { return "sample " + std::to_string(i); }

Texts numbered_from_to(int first, int last) {
  Texts texts;
  for (int i = first; i <= last; ++i) texts.push_back(numbered(i));
  return texts;
}

void put(Publisher& publisher, std::string_view what) { REQUIRE(publisher.put(bytes(what))); }

/// Waits until what `publisher` puts reaches `texts`: over Zenoh the declarations take a moment to travel.
void connect(Publisher& publisher, Gathered<std::string>& texts) {
  REQUIRE(eventually([&] {
    put(publisher, "hello");
    std::this_thread::sleep_for(20ms);
    return !texts.values().empty();
  }));
  std::this_thread::sleep_for(200ms);  // hellos still under way
}

Texts without_hellos(Texts texts) {
  std::erase(texts, "hello");
  return texts;
}

bool wait_for_text(const Gathered<std::string>& texts, const std::string& wanted) {
  return eventually([&] {
    const auto seen = texts.values();
    return std::find(seen.begin(), seen.end(), wanted) != seen.end();
  });
}

}  // namespace

TEMPLATE_TEST_CASE("transport: samples arrive in the order they were put", "", BOTH_TRANSPORTS) {
  const auto traffic = GENERATE(Traffic::imprint, Traffic::backlog, Traffic::health, Traffic::command, Traffic::bulk);
  Gathered<std::string> texts;
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  const auto subscription = opened(fusion->subscribe("line/cam1/imprint", {}, into(texts)));
  const auto publisher = opened(node->publish("line/cam1/imprint", {.traffic = traffic}));
  connect(*publisher, texts);
  for (int i = 0; i < 200; ++i) put(*publisher, numbered(i));
  REQUIRE(wait_for_text(texts, numbered(199)));
  CHECK(without_hellos(texts.values()) == numbered_from_to(0, 199));
}

TEMPLATE_TEST_CASE("transport: the key comes with the sample, and the payload byte by byte", "", BOTH_TRANSPORTS) {
  Gathered<Sample> samples;
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  const auto publisher = opened(node->publish("line/cam1/imprint", {.traffic = Traffic::imprint, .history = 1}));
  Bytes payload(100000);
  for (std::size_t i = 0; i < payload.size(); ++i) payload[i] = static_cast<std::uint8_t>(i * 7 + i / 256);
  REQUIRE(publisher->put(payload));
  const auto subscription =
      opened(fusion->subscribe("line/*/imprint", {.history = 1}, [&](const Sample& sample) { samples.add(sample); }));
  const auto got = samples.wait_for(1);
  REQUIRE(got.size() == 1);
  CHECK(got[0].key == "line/cam1/imprint");
  CHECK(got[0].payload == payload);
}

TEMPLATE_TEST_CASE("transport: a late subscriber gets the history, the newest of it, in order", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  const auto publisher = opened(node->publish("line/cam1/imprint", {.traffic = Traffic::imprint, .history = 5}));
  for (int i = 0; i < 8; ++i) put(*publisher, numbered(i));
  std::this_thread::sleep_for(300ms);  // what is still on the link would come as a live sample
  Gathered<std::string> all;
  Gathered<std::string> some;
  Gathered<std::string> none;
  const auto first = opened(fusion->subscribe("line/*/imprint", {.history = 10}, into(all)));
  const auto second = opened(fusion->subscribe("line/*/imprint", {.history = 2}, into(some)));
  const auto third = opened(fusion->subscribe("line/*/imprint", {}, into(none)));
  CHECK(all.wait_for(5) == numbered_from_to(3, 7));
  CHECK(some.wait_for(2) == numbered_from_to(6, 7));
  CHECK(none.values().empty());
  put(*publisher, numbered(8));
  CHECK(all.wait_for(6) == numbered_from_to(3, 8));
  CHECK(none.wait_for(1) == Texts{numbered(8)});
}

TEMPLATE_TEST_CASE("transport: a fusion started last misses nothing that is still kept", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto node = plant.node();  // opens at once though nobody is there
  const auto publisher = opened(node->publish("line/cam1/imprint", {.traffic = Traffic::imprint, .history = 10}));
  for (int i = 0; i < 4; ++i) put(*publisher, numbered(i));
  const auto fusion = plant.fusion();
  Gathered<std::string> texts;
  const auto subscription = opened(fusion->subscribe("line/*/imprint", {.history = 10}, into(texts)));
  CHECK(texts.wait_for(4) == numbered_from_to(0, 3));
  put(*publisher, numbered(4));
  CHECK(texts.wait_for(5) == numbered_from_to(0, 4));
}

TEMPLATE_TEST_CASE("transport: a subscriber that was there before its router gets what comes", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto watcher = plant.node();
  Gathered<std::string> texts;
  const auto subscription = opened(watcher->subscribe("line/result/*", {.history = 1}, into(texts)));
  const auto fusion = plant.fusion();
  const auto publisher = opened(fusion->publish("line/result/s1", {.traffic = Traffic::bulk, .history = 1}));
  put(*publisher, "result");
  CHECK(texts.wait_for(1) == Texts{"result"});
}

TEMPLATE_TEST_CASE("transport: the router carries between nodes and tools, both ways", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  const auto tool = plant.tool();
  const auto other_tool = plant.tool();
  const auto service = opened(
      node->answer("line/cam/cam1/service/log", [](const std::shared_ptr<Query>& q) { (void)q->reply(bytes("log")); }));
  const auto token = opened(node->announce("line/cam/cam1/alive"));
  Gathered<std::string> imprints;
  Gathered<std::string> triggers;
  Gathered<std::string> seen_triggers;
  Gathered<std::string> alive;
  const auto a = opened(tool->subscribe("line/cam/*/imprint", {.history = 3}, into(imprints)));
  const auto b = opened(node->subscribe("line/trigger", {.history = 1}, into(triggers)));
  const auto c = opened(other_tool->subscribe("line/trigger", {.history = 1}, into(seen_triggers)));
  const auto d = opened(
      tool->watch_liveness("line/cam/*/alive", [&](std::string_view key, bool) { alive.add(std::string(key)); }));
  const auto publisher = opened(node->publish("line/cam/cam1/imprint", {.traffic = Traffic::imprint, .history = 3}));
  const auto trigger = opened(tool->publish("line/trigger", {.traffic = Traffic::command, .history = 1}));
  put(*publisher, "imprint");
  put(*trigger, "trigger");
  CHECK(imprints.wait_for(1) == Texts{"imprint"});
  CHECK(triggers.wait_for(1) == Texts{"trigger"});
  CHECK(seen_triggers.wait_for(1) == Texts{"trigger"});
  CHECK(alive.wait_for(1) == Texts{"line/cam/cam1/alive"});
  CHECK(eventually([&] { return opened(tool->get("line/cam/*/service/log", {}, 5s)).size() == 1; }));
}

TEMPLATE_TEST_CASE("transport: wildcards choose the keys they match and no others", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  Gathered<std::string> imprints;
  Gathered<std::string> of_cam1;
  Gathered<std::string> everything;
  const auto a = opened(fusion->subscribe("line/cam/*/imprint", {.history = 9}, into(imprints)));
  const auto b = opened(fusion->subscribe("line/cam/cam1/**", {.history = 9}, into(of_cam1)));
  const auto c = opened(fusion->subscribe("line/**", {.history = 9}, into(everything)));
  std::vector<std::unique_ptr<Publisher>> publishers;
  for (const std::string key : {"line/cam/cam1/imprint", "line/cam/cam2/imprint", "line/cam/cam1/health",
                                "line/cam/cam1/deep/imprint", "other/cam/cam1/imprint"}) {
    publishers.push_back(opened(node->publish(key, {.traffic = Traffic::imprint, .history = 1})));
    put(*publishers.back(), key);
  }
  const auto sorted = [](Texts texts) {
    std::sort(texts.begin(), texts.end());
    return texts;
  };
  CHECK(sorted(everything.wait_for(4)) ==
        Texts{"line/cam/cam1/deep/imprint", "line/cam/cam1/health", "line/cam/cam1/imprint", "line/cam/cam2/imprint"});
  CHECK(sorted(imprints.wait_for(2)) == Texts{"line/cam/cam1/imprint", "line/cam/cam2/imprint"});
  CHECK(sorted(of_cam1.wait_for(3)) ==
        Texts{"line/cam/cam1/deep/imprint", "line/cam/cam1/health", "line/cam/cam1/imprint"});
}

TEMPLATE_TEST_CASE("transport: a query is answered from another thread", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  std::vector<std::future<void>> answers;
  const auto service = opened(node->answer("line/cam/cam1/service/config", [&](std::shared_ptr<Query> query) {
    answers.push_back(std::async(std::launch::async, [query = std::move(query)] {
      std::this_thread::sleep_for(50ms);
      (void)query->reply(bytes(query->key() + "|" + query->parameters() + "|" + text(query->payload())));
    }));
  }));
  std::vector<Sample> got;
  const auto start = std::chrono::steady_clock::now();
  REQUIRE(eventually([&] {
    got = opened(fusion->get("line/cam/cam1/service/config?section=edge", bytes("ask"), 60s));
    return !got.empty();
  }));
  // The answer ends the get, though the query object lives on in the future.
  CHECK(std::chrono::steady_clock::now() - start < kPatience);
  REQUIRE(got.size() == 1);
  CHECK(got[0].key == "line/cam/cam1/service/config");
  CHECK(text(got[0].payload) == "line/cam/cam1/service/config|section=edge|ask");
}

TEMPLATE_TEST_CASE("transport: a query with a wildcard is answered by all, each under its own key", "",
                   BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  std::vector<std::unique_ptr<Declaration>> services;
  for (const std::string id : {"cam1", "cam2", "cam3"})
    services.push_back(
        opened(node->answer("line/cam/" + id + "/service/log",
                            [id](const std::shared_ptr<Query>& query) { (void)query->reply(bytes(id)); })));
  std::vector<Sample> got;
  REQUIRE(eventually([&] {
    got = opened(fusion->get("line/cam/*/service/log", {}, 5s));
    return got.size() == 3;
  }));
  Texts lines;
  for (const auto& sample : got) lines.push_back(sample.key + " " + text(sample.payload));
  std::sort(lines.begin(), lines.end());
  CHECK(lines ==
        Texts{"line/cam/cam1/service/log cam1", "line/cam/cam2/service/log cam2", "line/cam/cam3/service/log cam3"});
}

TEMPLATE_TEST_CASE("transport: an error reply is an error with its message", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  const auto message = GENERATE(as<std::string>(), "no such section", "Timeout");
  const auto service = opened(node->answer(
      "line/service/config", [message](const std::shared_ptr<Query>& query) { (void)query->reply_error(message); }));
  Result<std::vector<Sample>> got;
  REQUIRE(eventually([&] {
    got = fusion->get("line/service/config", {}, 5s);
    return !got;
  }));
  CHECK(got.error().kind == ErrorKind::job_failed);
  CHECK(got.error().message == "query 'line/service/config': " + message);
}

TEMPLATE_TEST_CASE("transport: a get that nobody answers ends empty at its timeout", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  Gathered<std::shared_ptr<Query>> held;
  const auto service =
      opened(node->answer("line/service/slow", [&](std::shared_ptr<Query> query) { held.add(std::move(query)); }));
  REQUIRE(eventually([&] {
    REQUIRE(opened(fusion->get("line/service/slow", {}, 50ms)).empty());
    return !held.values().empty();
  }));
  const auto start = std::chrono::steady_clock::now();
  CHECK(opened(fusion->get("line/service/slow", {}, 300ms)).empty());
  const auto took = std::chrono::steady_clock::now() - start;
  CHECK(took >= 290ms);  // timers may be early by a tick
  CHECK(took < kPatience);
  for (const auto& query : held.values()) (void)query->reply(bytes("too late"));  // harms nobody
}

TEMPLATE_TEST_CASE("transport: a get where nobody serves ends empty without waiting", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  const auto start = std::chrono::steady_clock::now();
  CHECK(opened(fusion->get("line/service/none", {}, 10s)).empty());
  CHECK(std::chrono::steady_clock::now() - start < 5s);
}

TEMPLATE_TEST_CASE("transport: a query dropped without an answer ends the get", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  std::atomic<int> asked = 0;
  const auto service = opened(node->answer("line/service/mute", [&](const std::shared_ptr<Query>&) { ++asked; }));
  const auto start = std::chrono::steady_clock::now();
  REQUIRE(eventually([&] {
    REQUIRE(opened(fusion->get("line/service/mute", {}, 60s)).empty());
    return asked > 0;
  }));
  CHECK(std::chrono::steady_clock::now() - start < kPatience);
}

TEMPLATE_TEST_CASE("transport: a second answer to one query is refused", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  Gathered<bool> accepted;
  const auto service = opened(node->answer("line/service/twice", [&](const std::shared_ptr<Query>& query) {
    accepted.add(query->reply(bytes("one")).has_value());
    accepted.add(query->reply(bytes("two")).has_value());
  }));
  std::vector<Sample> got;
  REQUIRE(eventually([&] {
    got = opened(fusion->get("line/service/twice", {}, 5s));
    return !got.empty();
  }));
  CHECK(got.size() == 1);
  CHECK(accepted.wait_for(2) == std::vector<bool>{true, false});  // the first answer ends the get
}

TEMPLATE_TEST_CASE("transport: liveliness appears and disappears", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  auto early = plant.node();
  auto late = plant.node();
  Gathered<std::string> changes;
  const auto watch = [&](std::string_view key, bool alive) {
    changes.add(std::string(key) + (alive ? " up" : " down"));
  };

  auto before = opened(early->announce("line/cam/cam1/alive"));
  const auto watching = opened(fusion->watch_liveness("line/cam/*/alive", watch));
  CHECK(changes.wait_for(1) == Texts{"line/cam/cam1/alive up"});
  const auto after = opened(late->announce("line/cam/cam2/alive"));
  CHECK(changes.wait_for(2).back() == "line/cam/cam2/alive up");
  before.reset();
  CHECK(changes.wait_for(3).back() == "line/cam/cam1/alive down");
  CHECK(changes.values().size() == 3);
}

TEMPLATE_TEST_CASE("transport: nothing is called after its declaration is gone", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  const auto publisher = opened(node->publish("line/cam1/imprint", {.traffic = Traffic::imprint, .history = 3}));
  std::atomic<bool> stop = false;
  std::thread sender([&] {
    while (!stop) (void)publisher->put(bytes("flow"));
  });
  for (int round = 0; round < 20; ++round) {
    auto alive = std::make_unique<std::atomic<int>>(0);  // freed below: a late call would be caught by the sanitizer
    auto subscription = opened(fusion->subscribe("line/**", {.history = round % 2 == 0 ? 3U : 0U},
                                                 [raw = alive.get()](const Sample&) { ++*raw; }));
    if (round % 5 == 0) eventually([&] { return *alive > 0; });
    subscription.reset();
    alive.reset();
  }
  stop = true;
  sender.join();
}

TEMPLATE_TEST_CASE("transport: everything may go in any order while traffic flows", "", BOTH_TRANSPORTS) {
  TestType plant;
  auto fusion = plant.fusion();
  auto node = plant.node();
  std::atomic<int> seen = 0;
  auto subscription = opened(fusion->subscribe("line/**", {}, [&](const Sample&) { ++seen; }));
  auto token = opened(node->announce("line/alive"));
  const std::shared_ptr publisher = opened(node->publish("line/cam1/imprint", {.traffic = Traffic::imprint}));
  std::atomic<bool> stop = false;
  std::thread sender([&stop, publisher] {
    while (!stop) (void)publisher->put(bytes("flow"));
  });
  CHECK(eventually([&] { return seen > 100; }));
  node.reset();    // before its publisher and token
  fusion.reset();  // before its subscription
  subscription.reset();
  stop = true;
  sender.join();
  CHECK(publisher->put(bytes("still here")));
}

TEMPLATE_TEST_CASE("transport: a key that is none is refused by its name", "", BOTH_TRANSPORTS) {
  TestType plant;
  const auto node = plant.node();
  const auto ignore = [](const auto&...) {};
  CHECK(node->publish("line//imprint", {}).error().message ==
        "key 'line//imprint': expected chunks divided by single '/', found an empty one");
  CHECK(node->publish("line/*/imprint", {}).error().message ==
        "key 'line/*/imprint': expected a key without wildcards, found '*'");
  CHECK(node->subscribe("/line", {}, ignore).error().kind == ErrorKind::invalid_input);
  CHECK(node->answer("line/a*", ignore).error().message ==
        "key 'line/a*': expected chunks without '*', '#', '?', '$', found 'a*'");
  CHECK_FALSE(node->announce("line/*"));
  CHECK_FALSE(node->watch_liveness("line/", [](std::string_view, bool) {}));
  CHECK_FALSE(node->get("", {}, 1s));
}
