#include "fusion/serve/page_server.h"

#include <cmath>
#include <functional>
#include <optional>
#include <thread>

#include <httplib.h>

#include "fusion/report/result_plots.h"
#include "fusion/serve/metrics.h"
#include "fusion/serve/page.h"
#include "fusion/serve/page_access.h"
#include "lib/wire/keys.h"

namespace imprint {
namespace {

using nlohmann::json;

constexpr int kListedSessions = 100;
constexpr std::size_t kMaxRequestBytes = 16 * 1024;  // a few words at most
constexpr int kIdleTimeout_s = 5;
constexpr std::size_t kListedChanges = 200;
constexpr double kMaxRotation_deg = 3600.0;

void answer_json(httplib::Response& response, const json& document, int status = 200) {
  response.status = status;
  response.set_content(document.dump(-1, ' ', false, json::error_handler_t::replace), "application/json");
}

void answer_error(httplib::Response& response, int status, const std::string& message) {
  answer_json(response, {{"error", message}}, status);
}

class HttpPageServer final : public PageServer {
 public:
  HttpPageServer(std::unique_ptr<httplib::Server> server, std::optional<UserList> users, const PageConfig& config,
                 LineBoard& board, SessionStore& store, LineControl& control)
      : server_(std::move(server)),
        access_(std::move(users)),
        audit_(config.audit),
        https_(!config.identity.empty()),
        board_(board),
        store_(store),
        control_(control) {
    set_up();
    add_open_routes();
    add_routes();
    add_changes();
  }

  ~HttpPageServer() override {
    server_->stop();
    if (thread_.joinable()) thread_.join();
  }
  HttpPageServer(const HttpPageServer&) = delete;
  HttpPageServer& operator=(const HttpPageServer&) = delete;

  Result<void> listen(const PageConfig& config) {
    // The library's own choice, SO_REUSEPORT, would let two programs share the port unnoticed.
    server_->set_socket_options([](socket_t socket) {
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    port_ = config.port == 0 ? server_->bind_to_any_port(config.address)
                             : (server_->bind_to_port(config.address, config.port) ? config.port : -1);
    if (port_ <= 0) {
      return job_failed(
          "page: cannot listen on {}:{}: another program (a second imprint-fusion?) has the port, or the address is "
          "not "
          "this machine's; change page.port or page.address",
          config.address, config.port);
    }
    thread_ = std::thread([this] { server_->listen_after_bind(); });
    while (!server_->is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // stop() before is lost
    return {};
  }

  [[nodiscard]] int port() const override { return port_; }

 private:
  using Answer = std::function<void(const httplib::Request&, httplib::Response&, const Visitor&)>;

  void set_up() {
    server_->set_payload_max_length(kMaxRequestBytes);
    server_->set_read_timeout(kIdleTimeout_s);
    server_->set_keep_alive_timeout(kIdleTimeout_s);
    server_->set_default_headers(
        {{"Cache-Control", "no-store"},
         {"X-Content-Type-Options", "nosniff"},
         {"X-Frame-Options", "DENY"},
         {"Content-Security-Policy",
          "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'self'"}});
    server_->set_exception_handler([](const httplib::Request&, httplib::Response& response, const std::exception_ptr&) {
      answer_error(response, 500, "internal error");
    });
  }

  // What tells nothing of the line, and what a monitor without a name needs.
  void add_open_routes() {
    server_->Get("/", [](const httplib::Request&, httplib::Response& response) {
      response.set_content(kPage.data(), kPage.size(), "text/html; charset=utf-8");
    });
    server_->Get("/healthz", [this](const httplib::Request&, httplib::Response& response) {
      const bool healthy = !board_.has_alarm();
      answer_json(response, {{"healthy", healthy}}, healthy ? 200 : 503);
    });
    server_->Get("/metrics", [this](const httplib::Request&, httplib::Response& response) {
      response.set_content(prometheus_text(board_.status(std::chrono::steady_clock::now())),
                           "text/plain; version=0.0.4; charset=utf-8");
    });
    server_->Get("/api/me", [this](const httplib::Request& request, httplib::Response& response) {
      const auto visitor = access_.visitor(request);
      if (!visitor) return answer_error(response, 401, "not signed in");
      answer_json(response,
                  {{"name", visitor->name}, {"role", role_name(visitor->role)}, {"users", access_.has_users()}});
    });
  }

  // A route for whoever has at least this role.
  httplib::Server::Handler for_role(Role least, Answer answer) {
    return [this, least, answer = std::move(answer)](const httplib::Request& request, httplib::Response& response) {
      const auto visitor = access_.visitor(request);
      if (!visitor) return answer_error(response, 401, "not signed in");
      if (visitor->role < least) return answer_error(response, 403, fmt::format("needs the role {}", role_name(least)));
      answer(request, response, *visitor);
    };
  }

  void read(const char* path, std::function<void(const httplib::Request&, httplib::Response&)> answer) {
    server_->Get(path, for_role(Role::viewer, [answer = std::move(answer)](
                                                  const httplib::Request& request, httplib::Response& response,
                                                  const Visitor&) { answer(request, response); }));
  }

  void add_routes() {
    read("/api/status", [this](const httplib::Request&, httplib::Response& response) {
      answer_json(response, board_.status(std::chrono::steady_clock::now()));
    });
    read("/api/cameras", [this](const httplib::Request&, httplib::Response& response) {
      answer_json(response, {{"cameras", board_.status(std::chrono::steady_clock::now())["cameras"]}});
    });
    read("/api/sessions", [this](const httplib::Request&, httplib::Response& response) { answer_sessions(response); });
    read("/api/result/latest", [this](const httplib::Request&, httplib::Response& response) {
      answer_result(response, store_.latest_result(), "no result yet");
    });
    read(R"(/api/result/([A-Za-z0-9_.\-]{1,64}))",
         [this](const httplib::Request& request, httplib::Response& response) {
           const std::string session = request.matches[1];
           answer_result(response, store_.result(session), "no result of session " + session);
         });
    read(R"(/api/plots/([A-Za-z0-9_.\-]{1,64}))", [this](const httplib::Request& request, httplib::Response& response) {
      answer_plots(response, request.matches[1]);
    });
    server_->Get("/api/audit",
                 for_role(Role::engineer, [this](const httplib::Request&, httplib::Response& response, const Visitor&) {
                   const auto lines = audit_.newest(kListedChanges);
                   if (!lines) return answer_error(response, 503, lines.error().message);
                   answer_json(response, {{"changes", *lines}});
                 }));
  }

  // A change: sent by the page itself, its body a JSON object.
  httplib::Server::Handler change(std::function<void(const httplib::Request&, httplib::Response&, const json&)> make) {
    return [this, make = std::move(make)](const httplib::Request& request, httplib::Response& response) {
      if (!access_.is_own(request))
        return answer_error(response, 403, fmt::format("expected the header {}: 1", PageAccess::kOwnHeader));
      const json body = json::parse(request.body, nullptr, false);
      if (!body.is_object()) return answer_error(response, 400, "expected a JSON object");
      try {
        make(request, response, body);
      } catch (const json::exception& error) {
        answer_error(response, 400, error.what());
      }
    };
  }

  httplib::Server::Handler operators_change(
      std::function<void(const httplib::Request&, httplib::Response&, const json&, const Visitor&)> make) {
    return change(
        [this, make = std::move(make)](const httplib::Request& request, httplib::Response& response, const json& body) {
          for_role(Role::operator_, [&](const httplib::Request&, httplib::Response& out, const Visitor& visitor) {
            make(request, out, body, visitor);
          })(request, response);
        });
  }

  void add_changes() {
    server_->Post("/api/sign-in", change([this](const auto& request, auto& response, const json& body) {
                    sign_in(request, response, body.at("name").get<std::string>(),
                            body.at("password").get<std::string>());
                  }));
    server_->Post("/api/sign-out", change([this](const auto& request, auto& response, const json&) {
                    if (SignIn* users = access_.sign_in()) users->sign_out(PageAccess::token_of(request));
                    answer_json(response, {{"signed_out", true}});
                  }));
    server_->Post("/api/trigger",
                  operators_change([this](const auto& request, auto& response, const json& body,
                                          const Visitor& visitor) { trigger(request, response, body, visitor); }));
    server_->Post("/api/acknowledge", operators_change([this](const auto& request, auto& response, const json& body,
                                                              const Visitor& visitor) {
                    const auto name = body.at("alarm").get<std::string>();
                    if (!note(request, response, visitor.name, "acknowledged alarm " + name, body)) return;
                    if (!board_.acknowledge(name, visitor.name))
                      return answer_error(response, 404, "no alarm of that name waits to be acknowledged");
                    answer_json(response, {{"alarm", name}, {"acknowledged_by", visitor.name}});
                  }));
  }

  // What cannot be noted is not done.
  bool note(const httplib::Request& request, httplib::Response& response, const std::string& who,
            const std::string& what, json detail) {
    const auto noted = audit_.note(who, request.remote_addr, what, std::move(detail));
    if (!noted) answer_error(response, 503, noted.error().message);
    return noted.has_value();
  }

  void sign_in(const httplib::Request& request, httplib::Response& response, const std::string& name,
               const std::string& password) {
    SignIn* users = access_.sign_in();
    if (users == nullptr) return answer_error(response, 404, "this page has no users");
    const auto answer = users->sign_in(name, password, request.remote_addr, std::chrono::steady_clock::now());
    const bool welcome = answer.outcome == SignIn::Outcome::welcome;
    // A name that is none may be a password typed in the wrong field: it is not kept.
    const std::string who = welcome ? name : "somebody";
    if (!note(request, response, who, welcome ? "signed in" : "sign-in refused", json::object())) return;
    if (answer.outcome == SignIn::Outcome::too_many)
      return answer_error(response, 429, "too many wrong passwords; wait five minutes");
    if (!welcome) return answer_error(response, 401, "wrong name or password");
    response.set_header("Set-Cookie", fmt::format("{}={}; HttpOnly; SameSite=Strict; Path=/{}", PageAccess::kCookie,
                                                  answer.token, https_ ? "; Secure" : ""));
    answer_json(response, {{"name", answer.visitor.name}, {"role", role_name(answer.visitor.role)}, {"users", true}});
  }

  void trigger(const httplib::Request& request, httplib::Response& response, const json& body, const Visitor& visitor) {
    Trigger trigger;
    trigger.session = body.at("session").get<std::string>();
    trigger.observation = body.value("observation", 0U);
    trigger.rotation_deg = body.value("rotation_deg", 0.0);
    trigger.observations_expected = body.value("observations_expected", 0U);
    if (const auto valid = check_id("session", trigger.session); !valid)
      return answer_error(response, 400, valid.error().message);
    if (!(std::abs(trigger.rotation_deg) <= kMaxRotation_deg))
      return answer_error(response, 400, "rotation_deg: expected -3600 to 3600");
    const std::string what = fmt::format("triggered session {} observation {}", trigger.session, trigger.observation);
    if (!note(request, response, visitor.name, what, body)) return;
    if (const auto fired = control_.fire(trigger); !fired) return answer_error(response, 503, fired.error().message);
    answer_json(response, {{"session", trigger.session}, {"observation", trigger.observation}});
  }

  void answer_sessions(httplib::Response& response) {
    const auto sessions = store_.sessions(kListedSessions);
    if (!sessions) return answer_error(response, 503, sessions.error().message);
    json list = json::array();
    for (const SessionSummary& summary : *sessions) list.push_back(to_json(summary));
    answer_json(response, {{"sessions", std::move(list)}});
  }

  static void answer_result(httplib::Response& response, const Result<std::optional<StoredResult>>& result,
                            const std::string& absent) {
    if (!result) return answer_error(response, 503, result.error().message);
    if (!result->has_value()) return answer_error(response, 404, absent);
    answer_json(response, to_json(**result));
  }

  void answer_plots(httplib::Response& response, const std::string& session) {
    const auto stored = store_.result(session);
    if (!stored) return answer_error(response, 503, stored.error().message);
    if (!stored->has_value() || (*stored)->json.empty()) return answer_error(response, 404, "no result of " + session);
    const auto measurement = measurement_from_json(json::parse((*stored)->json, nullptr, false));
    if (!measurement) return answer_error(response, 500, measurement.error().message);
    const ResultPlots plots = draw_result(*measurement);
    answer_json(response, {{"axis_xy", plots.axis_xy},
                           {"axis_xz", plots.axis_xz},
                           {"diameter", plots.diameter},
                           {"circularity", plots.circularity},
                           {"direction", plots.direction}});
  }

  std::unique_ptr<httplib::Server> server_;
  PageAccess access_;
  AuditLog audit_;
  const bool https_;
  LineBoard& board_;
  SessionStore& store_;
  LineControl& control_;
  std::thread thread_;
  int port_ = 0;
};

Result<std::unique_ptr<httplib::Server>> make_server(const PageConfig& config) {
  if (config.identity.empty()) return std::make_unique<httplib::Server>();
  auto server = std::make_unique<httplib::SSLServer>((config.identity / "cert.pem").c_str(),
                                                     (config.identity / "key.pem").c_str());
  if (server->is_valid()) return server;
  return invalid_input("page: {}: expected cert.pem and key.pem of `imprint certs issue`", config.identity.string());
}

}  // namespace

bool PageConfig::is_local() const { return address == "localhost" || address == "::1" || address.starts_with("127."); }

Result<void> PageConfig::validate() const {
  if (address.empty()) return invalid_input("page.address: expected an address of this machine, found an empty text");
  if (port < 0 || port > 65535) return invalid_input("page.port: expected 0 to 65535, found {}", port);
  if (!is_local() && !insecure && (users.empty() || identity.empty()))
    return invalid_input(
        "page.address: {}: beyond this machine expected page.users and zenoh.identity, for passwords and HTTPS "
        "(docs/security.md); page.insecure = true shows the page to everybody as it is",
        address);
  return {};
}

Result<std::unique_ptr<PageServer>> PageServer::start(const PageConfig& config, LineBoard& board, SessionStore& store,
                                                      LineControl& control) {
  std::optional<UserList> users;
  if (!config.users.empty()) {
    auto read = read_user_list(config.users);
    if (!read) return pass_on(read.error());
    users = std::move(*read);
  }
  auto listener = make_server(config);
  if (!listener) return pass_on(listener.error());
  auto server = std::make_unique<HttpPageServer>(std::move(*listener), std::move(users), config, board, store, control);
  if (auto listening = server->listen(config); !listening) return pass_on(listening.error());
  return server;
}

}  // namespace imprint
