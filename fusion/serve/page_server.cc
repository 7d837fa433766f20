#include "fusion/serve/page_server.h"

#include <string_view>
#include <thread>

#include <httplib.h>

#include "fusion/report/result_plots.h"
#include "fusion/serve/page.h"

namespace imprint {
namespace {

using nlohmann::json;

constexpr int kListedSessions = 100;
constexpr std::size_t kMaxRequestBytes = 16 * 1024;  // nothing is uploaded
constexpr int kIdleTimeout_s = 5;

void answer_json(httplib::Response& response, const json& document, int status = 200) {
  response.status = status;
  response.set_content(document.dump(-1, ' ', false, json::error_handler_t::replace), "application/json");
}

void answer_error(httplib::Response& response, int status, const std::string& message) {
  answer_json(response, {{"error", message}}, status);
}

class HttpPageServer final : public PageServer {
 public:
  HttpPageServer(const LineBoard& board, SessionStore& store) : board_(board), store_(store) { add_routes(); }

  ~HttpPageServer() override {
    server_.stop();
    if (thread_.joinable()) thread_.join();
  }
  HttpPageServer(const HttpPageServer&) = delete;
  HttpPageServer& operator=(const HttpPageServer&) = delete;

  Result<void> listen(const PageConfig& config) {
    // The library's own choice, SO_REUSEPORT, would let two programs share the port unnoticed.
    server_.set_socket_options([](socket_t socket) {
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    port_ = config.port == 0 ? server_.bind_to_any_port(config.address)
                             : (server_.bind_to_port(config.address, config.port) ? config.port : -1);
    if (port_ <= 0) {
      return job_failed(
          "page: cannot listen on {}:{}: another program (a second imprint-fusion?) has the port, or the address is "
          "not "
          "this machine's; change page.port or page.address",
          config.address, config.port);
    }
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    while (!server_.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // stop() before is lost
    return {};
  }

  [[nodiscard]] int port() const override { return port_; }

 private:
  void add_routes() {
    server_.set_payload_max_length(kMaxRequestBytes);
    server_.set_read_timeout(kIdleTimeout_s);
    server_.set_keep_alive_timeout(kIdleTimeout_s);
    server_.set_default_headers(
        {{"Cache-Control", "no-store"},
         {"X-Content-Type-Options", "nosniff"},
         {"X-Frame-Options", "DENY"},
         {"Content-Security-Policy",
          "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'self'"}});
    server_.set_exception_handler([](const httplib::Request&, httplib::Response& response, const std::exception_ptr&) {
      answer_error(response, 500, "internal error");
    });
    server_.Get("/", [](const httplib::Request&, httplib::Response& response) {
      response.set_content(kPage.data(), kPage.size(), "text/html; charset=utf-8");
    });
    server_.Get("/api/status", [this](const httplib::Request&, httplib::Response& response) {
      answer_json(response, board_.status(std::chrono::steady_clock::now()));
    });
    server_.Get("/api/cameras", [this](const httplib::Request&, httplib::Response& response) {
      answer_json(response, {{"cameras", board_.status(std::chrono::steady_clock::now())["cameras"]}});
    });
    server_.Get("/api/sessions",
                [this](const httplib::Request&, httplib::Response& response) { answer_sessions(response); });
    server_.Get("/api/result/latest", [this](const httplib::Request&, httplib::Response& response) {
      answer_result(response, store_.latest_result(), "no result yet");
    });
    server_.Get(R"(/api/result/([A-Za-z0-9_.\-]{1,64}))",
                [this](const httplib::Request& request, httplib::Response& response) {
                  const std::string session = request.matches[1];
                  answer_result(response, store_.result(session), "no result of session " + session);
                });
    server_.Get(R"(/api/plots/([A-Za-z0-9_.\-]{1,64}))",
                [this](const httplib::Request& request, httplib::Response& response) {
                  answer_plots(response, request.matches[1]);
                });
    server_.Get("/healthz", [this](const httplib::Request&, httplib::Response& response) {
      const bool healthy = !board_.has_alarm();
      answer_json(response, {{"healthy", healthy}}, healthy ? 200 : 503);
    });
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

  const LineBoard& board_;
  SessionStore& store_;
  httplib::Server server_;
  std::thread thread_;
  int port_ = 0;
};

}  // namespace

Result<void> PageConfig::validate() const {
  if (address.empty()) return invalid_input("page.address: expected an address of this machine, found an empty text");
  if (port < 0 || port > 65535) return invalid_input("page.port: expected 0 to 65535, found {}", port);
  return {};
}

Result<std::unique_ptr<PageServer>> PageServer::start(const PageConfig& config, const LineBoard& board,
                                                      SessionStore& store) {
  auto server = std::make_unique<HttpPageServer>(board, store);
  if (auto listening = server->listen(config); !listening) return pass_on(listening.error());
  return server;
}

}  // namespace imprint
