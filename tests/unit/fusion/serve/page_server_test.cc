#include "fusion/serve/page_server.h"

#include <httplib.h>

#include <catch2/catch.hpp>

#include "fusion/results/measurement.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

// A server on a free port with one finished session in its store.
struct Server {
  TemporaryFolder folder;
  LineBoard board{{"plant", "L1", "best", "0.1.0"}, {"cam1"}, std::chrono::steady_clock::now()};
  std::unique_ptr<SessionStore> store = *SessionStore::open(folder / "imprint.db");
  LineControl control;
  std::unique_ptr<PageServer> page;

  Server() {
    REQUIRE(store->put_result({"S-1", true, "", R"({"length_mm": 1500.5, "observations": []})", 0, 0}));
    auto started = PageServer::start({.address = "127.0.0.1", .port = 0}, board, *store, control);
    REQUIRE(started);
    page = std::move(*started);
  }

  std::pair<int, std::string> get(const std::string& path) const {
    httplib::Client client("127.0.0.1", page->port());
    const auto answer = client.Get(path.c_str());
    REQUIRE(answer);
    return {answer->status, answer->body};
  }
  nlohmann::json json(const std::string& path) const { return nlohmann::json::parse(get(path).second); }
};

}  // namespace

TEST_CASE("page: it is one document that needs nothing from elsewhere") {
  const Server server;
  const auto [status, body] = server.get("/");
  REQUIRE(status == 200);
  REQUIRE(body.find("</html>") != std::string::npos);
  for (const char* reference : {"src=\"", "href=\"", "@import", "url("})
    REQUIRE(body.find(reference) == std::string::npos);
}

TEST_CASE("page: the API gives the status, the sessions and each result") {
  const Server server;
  REQUIRE(server.json("/api/status")["schema"] == "imprint.status/1");
  REQUIRE(server.json("/api/cameras")["cameras"][0]["id"] == "cam1");
  REQUIRE(server.json("/api/sessions")["sessions"][0]["length_mm"] == 1500.5);
  REQUIRE(server.json("/api/result/latest")["session"] == "S-1");
  REQUIRE(server.json("/api/result/S-1")["result"]["length_mm"] == 1500.5);
}

TEST_CASE("page: the pictures of a result come drawn; none for a session without one") {
  const Server server;
  Measurement measurement;
  for (int i = 0; i < 3; ++i) {
    const double s = 10.0 * i;
    measurement.sections.push_back({s, {s, 0.1, 0.2}, 0.22, 200.0, 1.0, 0.1, 0.1, 0.1});
  }
  REQUIRE(server.store->put_result({"S-2", true, "", to_json(measurement).dump(), 0, 0}));
  const auto plots = server.json("/api/plots/S-2");
  for (const char* name : {"axis_xy", "axis_xz", "diameter", "circularity", "direction"}) {
    CAPTURE(name);
    REQUIRE(plots[name].get<std::string>().starts_with("<svg"));
  }
  REQUIRE(server.get("/api/plots/another").first == 404);
  REQUIRE(server.get("/api/plots/S-1").first == 500);  // stored, but no whole result
}

TEST_CASE("page: what is not there is 404, whatever the path says") {
  const Server server;
  REQUIRE(server.get("/api/result/another").first == 404);
  REQUIRE(server.get("/api/result/..%2F..%2Fetc%2Fpasswd").first == 404);
  REQUIRE(server.get("/api/result/S-1'%20OR%201=1").first == 404);
  REQUIRE(server.get("/api/result/" + std::string(5000, 'x')).first == 404);
  REQUIRE(server.get("/nothing").first == 404);
}

TEST_CASE("page: an alarm turns the health check to 503") {
  Server server;
  REQUIRE(server.get("/healthz").first == 200);
  server.board.set_alarm("store", "disk full");
  REQUIRE(server.get("/healthz").first == 503);
}

TEST_CASE("page: a port that is taken is said so, with the port") {
  Server server;
  const auto second = PageServer::start({.address = "127.0.0.1", .port = server.page->port()}, server.board,
                                        *server.store, server.control);
  REQUIRE_FALSE(second);
  REQUIRE(second.error().exit_status() == 1);
  REQUIRE(second.error().message.find(std::to_string(server.page->port())) != std::string::npos);
}

}  // namespace imprint
