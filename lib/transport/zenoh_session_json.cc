#include "lib/transport/zenoh_session_json.h"

#include <array>
#include <string_view>
#include <system_error>

#include <nlohmann/json.hpp>

#include "lib/result/result.h"

namespace imprint {
namespace {

using nlohmann::json;

/// How long a full link may hold up an imprint before it is dropped: bursts pass, a camera hardly waits.
constexpr int kWaitBeforeDropUs = 20000;
/// How long a node waits for its connection before it goes on without: spares it losing its first messages.
constexpr int kConnectDelayMs = 500;

struct Endpoint {
  std::string_view protocol;
  std::string_view host;
};

Endpoint parts_of(std::string_view endpoint) {
  const auto slash = endpoint.find('/');
  if (slash == std::string_view::npos) return {};
  const std::string_view address = endpoint.substr(slash + 1);
  return {endpoint.substr(0, slash), address.substr(0, address.rfind(':'))};
}

bool is_this_machine(std::string_view host) {
  return host == "localhost" || host == "[::1]" || host.starts_with("127.");
}

Result<void> check_endpoint(std::string_view side, const std::string& text, const ZenohConfig& config) {
  const Endpoint endpoint = parts_of(text);
  const bool known = endpoint.protocol == "tcp" || endpoint.protocol == "tls" || endpoint.protocol == "udp";
  if (!known || text.find(':', text.find('/')) == std::string::npos)
    return invalid_input("{} endpoint '{}': expected tcp/HOST:PORT, tls/HOST:PORT or udp/HOST:PORT", side, text);
  if (endpoint.protocol == "tls" && config.identity.empty())
    return invalid_input(
        "{} endpoint '{}': TLS needs a certificate: set zenoh.identity (a command: --identity) to the folder that "
        "`imprint certs issue` made",
        side, text);
  if (endpoint.protocol != "tls" && !config.insecure && !config.tool && !is_this_machine(endpoint.host))
    return invalid_input(
        "{} endpoint '{}': over a network expected tls/HOST:PORT with zenoh.identity (docs/security.md); "
        "zenoh.insecure = true allows it as it is, then whoever reaches it can be any camera",
        side, text);
  return {};
}

Result<void> check_identity(const std::filesystem::path& folder) {
  for (const char* name : {"ca.pem", "cert.pem", "key.pem"}) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(folder / name, ignored))
      return invalid_input("zenoh.identity: {}: no such file; expected what `imprint certs issue` made",
                           (folder / name).string());
  }
  return {};
}

const char* mode_of(const ZenohConfig& config) {
  if (config.router) return "router";
  return config.tool ? "client" : "peer";
}

json tls_json(const std::filesystem::path& identity) {
  const std::string certificate = (identity / "cert.pem").string();
  const std::string key = (identity / "key.pem").string();
  return {{"root_ca_certificate", (identity / "ca.pem").string()},
          {"enable_mtls", true},
          {"listen_certificate", certificate},
          {"listen_private_key", key},
          {"connect_certificate", certificate},
          {"connect_private_key", key},
          {"verify_name_on_connect", true}};
}

/// The keys with those of their publishers' history, which `**` does not match.
json with_history(const std::vector<std::string>& keys) {
  json all = json::array();
  for (const std::string& key : keys) {
    all.push_back(key);
    all.push_back(key + "/@adv/**");
  }
  return all;
}

/// Zenoh's rules, one list a certificate name: what comes in from it, what goes out to it.
class AccessControl {
 public:
  explicit AccessControl(const std::vector<AccessRule>& rules) {
    // Declarations tell a session which of its messages anybody wants; they carry no data.
    add_rule("declarations", "egress",
             {"declare_subscriber", "declare_queryable", "declare_liveliness_subscriber", "liveliness_query"},
             {"**", "**/@adv/**"});
    for (const AccessRule& rule : rules) add(rule);
  }

  [[nodiscard]] json document() const {
    return {{"enabled", true},
            {"default_permission", "deny"},
            {"rules", rules_},
            {"subjects", subjects_},
            {"policies", policies_}};
  }

 private:
  void add(const AccessRule& rule) {
    json used = {"declarations"};
    const auto allow = [&](const char* what, const std::vector<std::string>& keys, const json& in, const json& out) {
      if (keys.empty()) return;
      const std::string id = rule.name + ' ' + what;
      add_rule(id + " in", "ingress", in, with_history(keys));
      add_rule(id + " out", "egress", out, with_history(keys));
      used.push_back(id + " in");
      used.push_back(id + " out");
    };
    allow("send", rule.send, {"put", "delete", "declare_queryable", "reply", "liveliness_token"}, {"query"});
    allow("receive", rule.receive, {"declare_subscriber", "declare_liveliness_subscriber", "liveliness_query"},
          {"put", "delete", "liveliness_token", "reply"});
    allow("ask", rule.ask, {"query"}, {"reply"});
    json history = json::array();  // a late subscriber asks the publishers
    for (const std::string& key : rule.receive) history.push_back(key + "/@adv/**");
    if (!history.empty()) {
      add_rule(rule.name + " history", "ingress", {"query"}, history);
      used.push_back(rule.name + " history");
    }
    subjects_.push_back({{"id", rule.name}, {"cert_common_names", {rule.name}}});
    policies_.push_back({{"id", rule.name}, {"rules", used}, {"subjects", {rule.name}}});
  }

  void add_rule(const std::string& id, const char* flow, const json& messages, const json& keys) {
    rules_.push_back(
        {{"id", id}, {"permission", "allow"}, {"flows", {flow}}, {"messages", messages}, {"key_exprs", keys}});
  }

  json rules_ = json::array();
  json subjects_ = json::array();
  json policies_ = json::array();
};

}  // namespace

Result<void> check_zenoh(const ZenohConfig& config) {
  for (const auto& endpoint : config.connect)
    if (auto checked = check_endpoint("connect", endpoint, config); !checked) return checked;
  for (const auto& endpoint : config.listen)
    if (auto checked = check_endpoint("listen", endpoint, config); !checked) return checked;
  if (config.tool && (config.router || config.connect.empty()))
    return invalid_input("Zenoh session of a tool: expected an endpoint to connect to, and no router, found {}",
                         config.router ? "a router" : "no endpoint");
  if (!config.identity.empty()) return check_identity(config.identity);
  return {};
}

// Peer and router mode open at once and go on trying to connect; client mode waits for its router. No multicast: only
// the endpoints named are ever spoken to. No time stamps: messages carry their own sensor time.
std::string zenoh_session_json(const ZenohConfig& config) {
  json session;
  session["mode"] = mode_of(config);
  session["connect"]["endpoints"] = config.connect;
  session["connect"]["timeout_ms"] = config.tool ? kToolTimeoutMs : -1;
  session["connect"]["exit_on_failure"] = config.tool;
  session["connect"]["retry"] = {{"period_init_ms", 200}, {"period_max_ms", 2000}, {"period_increase_factor", 2}};
  session["listen"] = {{"endpoints", config.listen}, {"timeout_ms", 0}, {"exit_on_failure", true}};
  session["scouting"]["multicast"]["enabled"] = false;
  session["scouting"]["delay"] = config.router ? 0 : kConnectDelayMs;
  session["timestamping"]["enabled"] = false;
  auto& link = session["transport"]["link"];
  link["tx"]["queue"]["congestion_control"]["drop"]["wait_before_drop"] = kWaitBeforeDropUs;
  if (!config.identity.empty()) link["tls"] = tls_json(config.identity);
  if (!config.access.empty()) session["access_control"] = AccessControl(config.access).document();
  return session.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace imprint
