#include "fusion/serve/page_server.h"

#include <httplib.h>

#include <catch2/catch.hpp>

#include "fusion/serve/sign_in.h"
#include "lib/config/atomic_file.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using std::chrono::minutes;
using std::chrono::steady_clock;

constexpr const char* kPassword = "red steel 1200";

// Hashing is slow on purpose: once for all.
const UserList& three_users() {
  static const UserList list = [] {
    const std::string hash = *hash_password(kPassword);
    return UserList{{{"vera", Role::viewer, hash}, {"otto", Role::operator_, hash}, {"erika", Role::engineer, hash}}};
  }();
  return list;
}

struct Server {
  TemporaryFolder folder;
  LineBoard board{{"plant", "L1", "best", "0.1.0"}, {"cam1"}, steady_clock::now()};
  std::unique_ptr<SessionStore> store = *SessionStore::open(folder / "imprint.db");
  std::vector<Trigger> fired;
  LineControl control;
  std::unique_ptr<PageServer> page;

  explicit Server(bool users) {
    control.connect([this](const Trigger& trigger) -> Result<void> {
      fired.push_back(trigger);
      return {};
    });
    PageConfig config{.address = "127.0.0.1", .port = 0};
    config.audit = folder / "audit.jsonl";
    if (users) {
      config.users = folder / "users.json";
      REQUIRE(write_user_list(config.users, three_users()));
    }
    auto started = PageServer::start(config, board, *store, control);
    REQUIRE(started);
    page = std::move(*started);
  }

  httplib::Result post(const char* path, const nlohmann::json& body, const std::string& cookie = "",
                       bool own = true) const {
    httplib::Headers headers;
    if (own) headers.emplace("X-Imprint", "1");
    if (!cookie.empty()) headers.emplace("Cookie", cookie);
    httplib::Client client("127.0.0.1", page->port());
    auto answer = client.Post(path, headers, body.dump(), "application/json");
    REQUIRE(answer);
    return answer;
  }
  int get(const char* path, const std::string& cookie = "") const {
    httplib::Client client("127.0.0.1", page->port());
    const auto answer = client.Get(path, httplib::Headers{{"Cookie", cookie}});
    REQUIRE(answer);
    return answer->status;
  }
  std::string signed_in(const char* name) const {
    const auto answer = post("/api/sign-in", {{"name", name}, {"password", kPassword}});
    REQUIRE(answer->status == 200);
    const std::string cookie = answer->get_header_value("Set-Cookie");
    REQUIRE(cookie.find("HttpOnly; SameSite=Strict") != std::string::npos);
    return cookie.substr(0, cookie.find(';'));
  }
  nlohmann::json audit() const {
    nlohmann::json lines = nlohmann::json::array();
    std::istringstream text(*read_file(folder / "audit.jsonl"));
    for (std::string line; std::getline(text, line);) lines.push_back(nlohmann::json::parse(line));
    return lines;
  }
};

const nlohmann::json kTrigger = {{"session", "F-1"}, {"observation", 2}, {"rotation_deg", 60.0}};

}  // namespace

TEST_CASE("passwords: a hash is yescrypt with its own salt, matches its password alone and is no password itself") {
  const auto first = hash_password(kPassword);
  const auto second = hash_password(kPassword);
  REQUIRE(first);
  REQUIRE(first->starts_with("$y$"));
  REQUIRE(*first != *second);
  REQUIRE(password_matches(kPassword, *first));
  REQUIRE_FALSE(password_matches("red steel 1201", *first));
  REQUIRE_FALSE(password_matches(*first, *first));
  for (const char* none : {"", "*0", "$1$abc$def", "red steel 1200"}) REQUIRE_FALSE(password_matches(kPassword, none));
  REQUIRE_FALSE(hash_password("short"));
  REQUIRE_FALSE(hash_password(std::string(300, 'x')));
}

TEST_CASE("sign-in: five wrong passwords close a name and an address for five minutes, the right one included") {
  SignIn sign_in(three_users());
  auto now = steady_clock::now();
  for (int i = 0; i < SignIn::kMaxFailures; ++i)
    REQUIRE(sign_in.sign_in("otto", "wrong password", "10.0.0.1", now).outcome == SignIn::Outcome::refused);
  REQUIRE(sign_in.sign_in("otto", kPassword, "10.0.0.2", now).outcome == SignIn::Outcome::too_many);
  REQUIRE(sign_in.sign_in("vera", kPassword, "10.0.0.1", now).outcome == SignIn::Outcome::too_many);
  REQUIRE(sign_in.sign_in("vera", kPassword, "10.0.0.2", now).outcome == SignIn::Outcome::welcome);
  now += SignIn::kFailureMemory;
  REQUIRE(sign_in.sign_in("otto", kPassword, "10.0.0.1", now).outcome == SignIn::Outcome::welcome);
}

TEST_CASE("sign-in: a token is good for its time, until signing out, and nothing like it is") {
  SignIn sign_in(three_users());
  const auto now = steady_clock::now();
  const auto answer = sign_in.sign_in("otto", kPassword, "10.0.0.1", now);
  REQUIRE(answer.token.size() == 64);
  REQUIRE(sign_in.who(answer.token, now)->name == "otto");
  REQUIRE_FALSE(sign_in.who("", now));
  REQUIRE_FALSE(sign_in.who(answer.token.substr(1), now));
  REQUIRE_FALSE(sign_in.who(answer.token, now + SignIn::kSignedInFor));
  sign_in.sign_out(answer.token);
  REQUIRE_FALSE(sign_in.who(answer.token, now));
}

TEST_CASE("page: with users nothing of the line is told to who is not signed in") {
  const Server server(true);
  for (const char* path :
       {"/api/status", "/api/cameras", "/api/sessions", "/api/result/latest", "/api/plots/S", "/api/audit", "/api/me"})
    REQUIRE(server.get(path) == 401);
  REQUIRE(server.get("/") == 200);
  REQUIRE(server.post("/api/trigger", kTrigger)->status == 401);
  REQUIRE(server.post("/api/sign-in", {{"name", "otto"}, {"password", "not his password"}})->status == 401);
  REQUIRE(server.fired.empty());
}

TEST_CASE("page: viewers read, operators trigger and acknowledge, engineers read the audit; each change names who") {
  Server server(true);
  const std::string vera = server.signed_in("vera"), otto = server.signed_in("otto"), erika = server.signed_in("erika");
  REQUIRE(server.get("/api/status", vera) == 200);
  REQUIRE(server.post("/api/trigger", kTrigger, vera)->status == 403);
  REQUIRE(server.fired.empty());
  REQUIRE(server.post("/api/trigger", kTrigger, otto)->status == 200);
  REQUIRE(server.fired.size() == 1);
  REQUIRE(server.fired[0].observation == 2);
  server.board.set_alarm("store", "disk full");
  REQUIRE(server.post("/api/acknowledge", {{"alarm", "store"}}, vera)->status == 403);
  REQUIRE(server.post("/api/acknowledge", {{"alarm", "store"}}, otto)->status == 200);
  REQUIRE(server.board.status(steady_clock::now())["alarms"][0]["acknowledged_by"] == "otto");
  REQUIRE(server.post("/api/acknowledge", {{"alarm", "store"}}, otto)->status == 404);
  REQUIRE(server.get("/api/audit", otto) == 403);
  REQUIRE(server.get("/api/audit", erika) == 200);
  std::vector<std::string> told;
  for (const auto& line : server.audit())
    told.push_back(line["who"].get<std::string>() + ": " + line["what"].get<std::string>());
  REQUIRE(told == std::vector<std::string>{"vera: signed in", "otto: signed in", "erika: signed in",
                                           "otto: triggered session F-1 observation 2",
                                           "otto: acknowledged alarm store", "otto: acknowledged alarm store"});
  REQUIRE(read_file(server.folder / "audit.jsonl")->find(kPassword) == std::string::npos);
}

TEST_CASE("page: a change that another site's page could send is refused") {
  Server server(false);
  REQUIRE(server.post("/api/trigger", kTrigger, "", false)->status == 403);
  httplib::Client client("127.0.0.1", server.page->port());
  const auto rebound = client.Post("/api/trigger", httplib::Headers{{"X-Imprint", "1"}, {"Host", "evil.example"}},
                                   kTrigger.dump(), "application/json");
  REQUIRE(rebound->status == 403);
  REQUIRE(server.fired.empty());
  REQUIRE(server.post("/api/trigger", kTrigger)->status == 200);  // without users whoever is at this machine operates
}

TEST_CASE("page: what is no trigger is refused and fires nothing") {
  Server server(false);
  for (const char* body : {"", "[]", "{", "{}", R"({"session": 5})", R"({"session": "../x"})",
                           R"({"session": "S", "rotation_deg": 1e9})", R"({"session": "S", "observation": "two"})"}) {
    httplib::Client client("127.0.0.1", server.page->port());
    REQUIRE(client.Post("/api/trigger", httplib::Headers{{"X-Imprint", "1"}}, body, "application/json")->status == 400);
  }
  REQUIRE(server.fired.empty());
}

TEST_CASE("page: a change that cannot be noted is not made") {
  Server server(false);
  std::filesystem::create_directory(server.folder / "audit.jsonl");  // no file can be there
  REQUIRE(server.post("/api/trigger", kTrigger)->status == 503);
  REQUIRE(server.fired.empty());
}

TEST_CASE("page: beyond this machine it wants users and a certificate, or to be told that it may be seen by all") {
  PageConfig config{.address = "0.0.0.0", .port = 0};
  REQUIRE_FALSE(config.validate());
  config.users = "users.json";
  REQUIRE_FALSE(config.validate());
  config.identity = "identity";
  REQUIRE(config.validate());
  REQUIRE(PageConfig{.address = "0.0.0.0", .port = 0, .insecure = true}.validate());
}

}  // namespace imprint
