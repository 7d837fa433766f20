#include <catch2/catch.hpp>

#include "tests/unit/lib/transport/plants.h"

using namespace imprint;
using namespace imprint::test;

TEST_CASE("zenoh: an endpoint that is none is refused by its name, before anything is opened") {
  for (const std::string endpoint : {"10.0.0.5:7447", "tcp:10.0.0.5", "http/10.0.0.5:80", "tcp/10.0.0.5", ""}) {
    const auto connect = open_zenoh({.connect = {endpoint}});
    REQUIRE_FALSE(connect);
    CHECK(connect.error().kind == ErrorKind::invalid_input);
    CHECK(connect.error().message ==
          "connect endpoint '" + endpoint + "': expected tcp/HOST:PORT, tls/HOST:PORT or udp/HOST:PORT");
    CHECK_FALSE(open_zenoh({.listen = {endpoint}, .router = true}));
  }
}

TEST_CASE("zenoh: a port that is taken is an error that names the endpoint") {
  const std::string endpoint = "tcp/127.0.0.1:" + std::to_string(free_port());
  const auto first = open_zenoh({.listen = {endpoint}, .router = true});
  REQUIRE(first);
  const auto second = open_zenoh({.listen = {endpoint}, .router = true});
  REQUIRE_FALSE(second);
  INFO(second.error().message);
  CHECK(second.error().kind == ErrorKind::job_failed);
  CHECK(second.error().message.find("listen [" + endpoint + "]") != std::string::npos);
  CHECK(second.error().message.find(".rs:") == std::string::npos);
  CHECK(second.error().message.find('\n') == std::string::npos);
}

TEST_CASE("zenoh: opening does not wait for the other side") {
  const auto start = std::chrono::steady_clock::now();
  const auto node = open_zenoh({.connect = {"tcp/127.0.0.1:" + std::to_string(free_port())}});
  REQUIRE(node);
  const auto publisher = (*node)->publish("line/cam1/imprint", {.traffic = Traffic::command});
  REQUIRE(publisher);
  CHECK((*publisher)->put(bytes("nobody hears")));
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(5));  // measured: 0.05 s
}

TEST_CASE("zenoh: a tool without a router to reach says so after 3 s") {
  const std::string endpoint = "tcp/127.0.0.1:" + std::to_string(free_port());
  const auto start = std::chrono::steady_clock::now();
  const auto tool = open_zenoh({.connect = {endpoint}, .tool = true});
  REQUIRE_FALSE(tool);
  CHECK(tool.error().kind == ErrorKind::job_failed);
  CHECK(tool.error().message ==
        "connect endpoint " + endpoint + ": no router reached within 3 s: is imprint-fusion running there?");
  CHECK(std::chrono::steady_clock::now() - start < kPatience);
  CHECK(open_zenoh({.tool = true}).error().kind == ErrorKind::invalid_input);
}

TEST_CASE("zenoh: a tool that is open finds a router that was restarted") {
  ZenohPlant plant;
  auto fusion = plant.fusion();
  const auto tool = plant.tool();
  Gathered<std::string> texts;
  const auto subscription = opened(
      tool->subscribe("line/**", {.history = 1}, [&](const Sample& sample) { texts.add(text(sample.payload)); }));
  fusion.reset();
  fusion = plant.fusion();
  const auto publisher = opened(fusion->publish("line/a", {.traffic = Traffic::bulk, .history = 1}));
  REQUIRE(publisher->put(bytes("again")));
  CHECK(texts.wait_for(1) == std::vector<std::string>{"again"});
}

TEST_CASE("zenoh: a burst on a link that drops is recovered from the history, whole and in order") {
  ZenohPlant plant;
  const auto fusion = plant.fusion();
  const auto node = plant.node();
  Gathered<std::string> texts;
  Gathered<std::uint32_t> missed;
  const auto subscription = opened(fusion->subscribe(
      "line/**", {.history = 500}, [&](const Sample& sample) { texts.add(text(sample.payload)); },
      [&](std::string_view, std::uint32_t count) { missed.add(count); }));
  const auto publisher = opened(node->publish("line/cam1/imprint", {.traffic = Traffic::imprint, .history = 500}));
  std::vector<std::string> sent;
  for (int i = 0; i < 500; ++i) {
    sent.push_back(std::to_string(i) + std::string(4000, ' '));
    REQUIRE(publisher->put(bytes(sent.back())));
  }
  CHECK((texts.wait_for(500) == sent));
  CHECK(missed.values().empty());
}

TEST_CASE("zenoh: a node finds a router that was restarted, and its history is not lost") {
  ZenohPlant plant;
  const auto node = plant.node();
  const auto publisher = opened(node->publish("line/cam1/imprint", {.traffic = Traffic::imprint, .history = 20}));
  for (int restart = 0; restart < 2; ++restart) {
    auto fusion = plant.fusion();
    Gathered<std::string> texts;
    const auto subscription = opened(
        fusion->subscribe("line/**", {.history = 20}, [&](const Sample& sample) { texts.add(text(sample.payload)); }));
    REQUIRE(publisher->put(bytes(std::to_string(restart))));
    CHECK(texts.wait_for(static_cast<std::size_t>(restart) + 1).back() == std::to_string(restart));
    CHECK(texts.values().size() == static_cast<std::size_t>(restart) + 1);
  }
}

TEST_CASE("zenoh: an exception in a callback does not end the process") {
  ZenohPlant plant;
  const auto fusion = plant.fusion();
  Gathered<std::string> texts;
  const auto broken =
      opened(fusion->subscribe("line/a", {}, [](const Sample&) { throw std::runtime_error("callback failed"); }));
  const auto sound = opened(fusion->subscribe("line/*", {}, [&](const Sample& s) { texts.add(text(s.payload)); }));
  const auto service = opened(
      fusion->answer("line/q", [](const std::shared_ptr<Query>&) { throw std::runtime_error("service failed"); }));
  const auto publisher = opened(fusion->publish("line/a", {}));
  REQUIRE(publisher->put(bytes("one")));
  CHECK(texts.wait_for(1).size() == 1);
  const auto answer = fusion->get("line/q", {}, std::chrono::seconds(5));
  REQUIRE_FALSE(answer);
  CHECK(answer.error().message == "query 'line/q': service failed");
}
