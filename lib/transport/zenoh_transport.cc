#include <algorithm>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <regex>
#include <utility>

#include "lib/transport/callback_gate.h"
#include "lib/transport/key_expression.h"
#include "lib/transport/transport.h"
#include "lib/transport/zenoh_bridge/handlers.h"
#include "lib/transport/zenoh_session_json.h"
#include "zenoh_bridge.h"

namespace imprint {
namespace {

/// What Zenoh says of a failure, without the places in its source where it said so.
std::string reason_of(const std::exception& error) {
  static const std::regex place(R"( at \S+\.rs:\d+\.?)");
  return std::regex_replace(error.what(), place, "");
}

rust::Slice<const std::uint8_t> slice(std::span<const std::uint8_t> bytes) { return {bytes.data(), bytes.size()}; }
rust::Str str(std::string_view text) { return {text.data(), text.size()}; }
std::string_view view(rust::Str text) { return {text.data(), text.size()}; }

/// Priority and congestion control of each class of traffic.
///
/// Classes never share a priority: within one, messages that may be dropped can stall for seconds behind
/// messages that block. `command` is rare and small and must arrive: it blocks, and a link that stays full is
/// given up by Zenoh after 5 s. An imprint must never hold up its camera: when the link is full it is dropped
/// and later recovered from the publisher's history. The next health report makes good for a lost one. Bulk
/// (results, crops, logs) is fragmented, and fragments that may be dropped are given up after 50 ms: it blocks,
/// below everything else, so its sender must be a thread that may wait.
bridge::PublisherSetup setup_of(const PublisherOptions& options) {
  bridge::PublisherSetup setup{};
  setup.history = options.history;
  switch (options.traffic) {
    case Traffic::command:
      setup.priority = 2;  // interactive, high
      setup.block = true;
      setup.express = true;
      break;
    case Traffic::imprint:
      setup.priority = 4;  // data, high
      setup.express = true;
      break;
    case Traffic::backlog:
      setup.priority = 5;  // data: what is measured now goes first
      break;
    case Traffic::health:
      setup.priority = 6;  // data, low
      break;
    case Traffic::bulk:
      setup.priority = 7;  // background
      setup.block = true;
      break;
  }
  return setup;
}

class SampleForwarder final : public bridge::SampleHandler {
 public:
  SampleForwarder(std::shared_ptr<CallbackGate> gate, SampleCallback on_sample, MissCallback on_miss)
      : gate_(std::move(gate)), on_sample_(std::move(on_sample)), on_miss_(std::move(on_miss)) {}

  void on_sample(rust::Str key, rust::Slice<const std::uint8_t> payload) const override {
    gate_->pass([&] { on_sample_({std::string(key), Bytes(payload.begin(), payload.end())}); });
  }
  void on_miss(rust::Str source, std::uint32_t count) const override {
    if (on_miss_) gate_->pass([&] { on_miss_(view(source), count); });
  }

 private:
  std::shared_ptr<CallbackGate> gate_;
  SampleCallback on_sample_;
  MissCallback on_miss_;
};

class LivenessForwarder final : public bridge::LivenessHandler {
 public:
  LivenessForwarder(std::shared_ptr<CallbackGate> gate, LivenessCallback on_change)
      : gate_(std::move(gate)), on_change_(std::move(on_change)) {}

  void on_change(rust::Str key, bool alive) const override {
    gate_->pass([&] { on_change_(view(key), alive); });
  }

 private:
  std::shared_ptr<CallbackGate> gate_;
  LivenessCallback on_change_;
};

class ZenohQuery final : public Query {
 public:
  explicit ZenohQuery(rust::Box<bridge::Request> request)
      : key_(request->key()), parameters_(request->parameters()), request_(std::move(request)) {
    const auto payload = (*request_)->payload();
    payload_.assign(payload.begin(), payload.end());
  }

  std::string key() const override { return key_; }
  std::string parameters() const override { return parameters_; }
  Bytes payload() const override { return payload_; }
  Result<void> reply(std::span<const std::uint8_t> payload) override {
    return answer([&] { (*request_)->reply(slice(payload)); });
  }
  Result<void> reply_error(std::string_view message) override {
    return answer([&] { (*request_)->reply_error(str(message)); });
  }

 private:
  template <class Send>
  Result<void> answer(Send&& send) {
    const std::lock_guard lock(mutex_);
    if (!request_) return job_failed("query on '{}': expected one answer, found a second", key_);
    try {
      send();
    } catch (const rust::Error& error) {
      return job_failed("query on '{}': cannot be answered: {}", key_, reason_of(error));
    }
    request_.reset();  // tells the asking side that nothing more will come
    return {};
  }

  std::string key_;
  std::string parameters_;
  Bytes payload_;
  std::mutex mutex_;
  std::optional<rust::Box<bridge::Request>> request_;
};

class RequestForwarder final : public bridge::RequestHandler {
 public:
  RequestForwarder(std::shared_ptr<CallbackGate> gate, QueryCallback on_query)
      : gate_(std::move(gate)), on_query_(std::move(on_query)) {}

  void on_request(rust::Box<bridge::Request> request) const override {
    gate_->pass([&] { on_query_(std::make_shared<ZenohQuery>(std::move(request))); });
  }

 private:
  std::shared_ptr<CallbackGate> gate_;
  QueryCallback on_query_;
};

/// Names those who connect, by the certificates they came with.
class PeerReporter final : public bridge::PeerHandler {
 public:
  explicit PeerReporter(PeerCallback on_peer) : on_peer_(std::move(on_peer)) {}

  void on_link(bool opened, rust::Str id, rust::Str name, rust::Str address) const override {
    {
      const std::lock_guard lock(mutex_);
      if (names_.size() >= kMaxRemembered) names_.clear();
      if (opened) names_[std::string(id)] = std::string(name);
    }
    on_peer_({opened ? PeerNotice::Kind::connected : PeerNotice::Kind::gone, std::string(name), std::string(address)});
  }
  void on_denied(rust::Str id, rust::Str action, rust::Str key) const override {
    on_peer_({PeerNotice::Kind::denied, name_of(std::string(id)), std::string(action) + " on " + std::string(key)});
  }
  void on_handshake_refused(rust::Str reason) const override {
    on_peer_({PeerNotice::Kind::handshake_refused, "", std::string(reason)});
  }
  void on_not_let_in(rust::Str endpoint, rust::Str reason) const override {
    on_peer_({PeerNotice::Kind::not_let_in, "", std::string(endpoint) + ": " + std::string(reason)});
  }

 private:
  static constexpr std::size_t kMaxRemembered = 1024;

  std::string name_of(const std::string& id) const {
    const std::lock_guard lock(mutex_);
    const auto found = names_.find(id);
    return found == names_.end() ? "" : found->second;
  }

  PeerCallback on_peer_;
  mutable std::mutex mutex_;
  mutable std::map<std::string, std::string> names_;  // by session id
};

/// The session lives until the last of what was declared on it is gone, in whatever order they go.
using SharedSession = std::shared_ptr<rust::Box<bridge::Session>>;

class ZenohPublisher final : public Publisher {
 public:
  ZenohPublisher(SharedSession session, std::string key, rust::Box<bridge::Publisher> publisher)
      : session_(std::move(session)), key_(std::move(key)), publisher_(std::move(publisher)) {}

  Result<void> put(std::span<const std::uint8_t> payload) override {
    try {
      publisher_->put(slice(payload));
      return {};
    } catch (const rust::Error& error) {
      return job_failed("key '{}': cannot be published: {}", key_, reason_of(error));
    }
  }

 private:
  SharedSession session_;
  std::string key_;
  rust::Box<bridge::Publisher> publisher_;
};

/// Whatever the Rust side declared; taken back after the last callback has returned.
template <class Declared>
class ZenohDeclaration final : public Declaration {
 public:
  ZenohDeclaration(SharedSession session, std::shared_ptr<CallbackGate> gate, rust::Box<Declared> declared)
      : session_(std::move(session)), gate_(std::move(gate)), declared_(std::move(declared)) {}
  ~ZenohDeclaration() override { gate_->close(); }
  ZenohDeclaration(const ZenohDeclaration&) = delete;
  ZenohDeclaration& operator=(const ZenohDeclaration&) = delete;

 private:
  SharedSession session_;
  std::shared_ptr<CallbackGate> gate_;
  rust::Box<Declared> declared_;
};

class ZenohTransport final : public Transport {
 public:
  explicit ZenohTransport(rust::Box<bridge::Session> session)
      : session_(std::make_shared<rust::Box<bridge::Session>>(std::move(session))) {}

  Result<std::unique_ptr<Publisher>> publish(const std::string& key, PublisherOptions options) override {
    if (auto checked = check_key(key, false); !checked) return pass_on(checked.error());
    try {
      return std::make_unique<ZenohPublisher>(session_, key, (*session_)->declare_publisher(key, setup_of(options)));
    } catch (const rust::Error& error) {
      return job_failed("key '{}': cannot be declared for publishing: {}", key, reason_of(error));
    }
  }

  Result<std::unique_ptr<Declaration>> subscribe(const std::string& key, SubscriberOptions options,
                                                 SampleCallback on_sample, MissCallback on_miss) override {
    return declare<bridge::Subscriber>(key, true, "subscribed", [&](const std::shared_ptr<CallbackGate>& gate) {
      return (*session_)->declare_subscriber(
          key, options.history, std::make_shared<SampleForwarder>(gate, std::move(on_sample), std::move(on_miss)));
    });
  }

  Result<std::unique_ptr<Declaration>> answer(const std::string& key, QueryCallback on_query) override {
    return declare<bridge::Queryable>(key, true, "answered", [&](const std::shared_ptr<CallbackGate>& gate) {
      return (*session_)->declare_queryable(key, std::make_shared<RequestForwarder>(gate, std::move(on_query)));
    });
  }

  Result<std::unique_ptr<Declaration>> announce(const std::string& key) override {
    return declare<bridge::Token>(
        key, false, "announced", [&](const std::shared_ptr<CallbackGate>&) { return (*session_)->declare_token(key); });
  }

  Result<std::unique_ptr<Declaration>> watch_liveness(const std::string& key, LivenessCallback on_change) override {
    return declare<bridge::TokenWatch>(key, true, "watched", [&](const std::shared_ptr<CallbackGate>& gate) {
      return (*session_)->watch_tokens(key, std::make_shared<LivenessForwarder>(gate, std::move(on_change)));
    });
  }

  using Transport::get;
  Result<std::vector<Sample>> get(const std::string& selector, std::span<const std::uint8_t> payload,
                                  std::chrono::milliseconds timeout, Traffic traffic) override {
    const std::string key = selector.substr(0, selector.find('?'));
    if (auto checked = check_key(key, true); !checked) return pass_on(checked.error());
    try {
      std::vector<Sample> samples;
      const auto wait_ms = static_cast<std::uint64_t>(std::max<std::int64_t>(timeout.count(), 0));
      for (const auto& reply :
           (*session_)->get(selector, slice(payload), wait_ms, setup_of({.traffic = traffic, .history = 0}))) {
        if (reply.timed_out) continue;
        if (!reply.ok)
          return job_failed("query '{}': {}", selector, std::string(reply.payload.begin(), reply.payload.end()));
        samples.push_back({std::string(reply.key), Bytes(reply.payload.begin(), reply.payload.end())});
      }
      return samples;
    } catch (const rust::Error& error) {
      return job_failed("query '{}': cannot be sent: {}", selector, reason_of(error));
    }
  }

 private:
  template <class Declared, class Declare>
  Result<std::unique_ptr<Declaration>> declare(const std::string& key, bool wildcards, std::string_view verb,
                                               Declare&& make) {
    if (auto checked = check_key(key, wildcards); !checked) return pass_on(checked.error());
    auto gate = std::make_shared<CallbackGate>();
    try {
      return std::make_unique<ZenohDeclaration<Declared>>(session_, gate, make(gate));
    } catch (const rust::Error& error) {
      return job_failed("key '{}': cannot be {}: {}", key, verb, reason_of(error));
    }
  }

  SharedSession session_;
};

std::string joined(const std::vector<std::string>& endpoints) {
  std::string text;
  for (const auto& endpoint : endpoints) text += (text.empty() ? "" : ", ") + endpoint;
  return text;
}

}  // namespace

Result<std::unique_ptr<Transport>> open_zenoh(const ZenohConfig& config) {
  if (auto checked = check_zenoh(config); !checked) return pass_on(checked.error());
  try {
    static std::once_flag log_once;
    std::call_once(log_once, [] { bridge::log_to_stderr("error"); });
    auto session = bridge::open_session(zenoh_session_json(config));
    if (config.on_peer) {
      const auto reporter = std::make_shared<PeerReporter>(config.on_peer);
      bridge::report_refusals_to(reporter);
      session->watch_links(reporter);
    }
    return std::make_unique<ZenohTransport>(std::move(session));
  } catch (const rust::Error& error) {
    if (config.tool)
      return job_failed("connect endpoint {}: no router reached within {} s: is imprint-fusion running there{}?",
                        joined(config.connect), kToolTimeoutMs / 1000,
                        config.identity.empty() ? "" : ", and of the plant that signed " + config.identity.string());
    const std::string reason = reason_of(error);
    const bool taken = reason.find("already in use") != std::string::npos;
    return job_failed(
        "Zenoh session (connect [{}], listen [{}]): cannot be opened: {}{}", joined(config.connect),
        joined(config.listen), reason,
        taken ? "; another program (a second imprint-fusion?) listens there: stop it or change zenoh.listen" : "");
  }
}

}  // namespace imprint
